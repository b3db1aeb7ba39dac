"""What bodies share: their base classes."""
