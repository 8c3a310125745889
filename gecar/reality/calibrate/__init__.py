"""A robot's own constants fitted to recordings."""
