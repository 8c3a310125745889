"""Recorded commands replayed through the simulation, and the paths and readings that follow from them."""
