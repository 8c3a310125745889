"""Intervals of fitted parameters, and detection limits."""
