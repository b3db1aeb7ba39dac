"""Study files: a sweep described in TOML."""
