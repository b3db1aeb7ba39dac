"""Results between incidences, interpolated where that is known to be good enough."""
