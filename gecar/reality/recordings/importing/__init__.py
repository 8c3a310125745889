"""Logs converted to recordings: read, guess, repair, join."""
