"""Measured less simulated, whitened: of the motion, and of the colour sensor along the measured path."""
