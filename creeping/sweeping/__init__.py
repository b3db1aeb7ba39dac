"""Many incidences: shadow lines and fans at sweep speed, studies, and the store of their results."""
