"""Whitened residuals, measured minus simulated, of the motion and of the colour sensor along the measured path."""
