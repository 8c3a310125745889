"""Replays of recorded commands through the simulation, with the resulting paths and readings."""
