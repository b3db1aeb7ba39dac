"""What fields, echoes and responses are: complex values with their errors, statuses and labels."""
