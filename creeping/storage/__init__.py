"""Files written aside and renamed, and folders of arrays with a manifest; knows nothing of what they hold."""
