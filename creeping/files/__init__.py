"""What other programs read: tables, lines on the body, far-field files."""
