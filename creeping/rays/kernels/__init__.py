"""Compiled quantities along rays, and the search for where they are shed."""
