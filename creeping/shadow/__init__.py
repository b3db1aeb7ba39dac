"""The shadow line n.d = 0 of one direction or of many, and what part of it launches rays."""
