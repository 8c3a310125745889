"""Commands: their options and help; one module each, which imports nothing slow."""
