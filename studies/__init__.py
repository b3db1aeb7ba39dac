"""Questions to the method, one a file: figures of the paper, accuracy, cost."""
