"""Recordings of a real robot: what the simulation makes of them, and what it lacks."""
