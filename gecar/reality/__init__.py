"""Recordings of a real robot, compared with the simulation: calibration, and discovery of missing physics."""
