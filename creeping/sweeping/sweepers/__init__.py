"""What computes the results of incidences."""
