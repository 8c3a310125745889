"""Fits of a robot's constants to recordings."""
