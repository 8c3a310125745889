"""Noise of the sensors, estimated from recordings, and the energy of residuals in excess of it."""
