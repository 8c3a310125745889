"""Minimisers that know nothing of robots: robust least squares, and CMA-ES where the landscape is rough."""
