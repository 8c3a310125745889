"""Evolve readable robot programs in a fast planar simulation, and close the gap to the real robot."""

__version__ = "0.1.0"
