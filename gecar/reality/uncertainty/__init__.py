"""Intervals of what was fitted."""
