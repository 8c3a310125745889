"""Tests of a robot found on held-out recordings, and of the remaining residuals for whiteness."""
