"""A lower bound on the time to GOAL: docs/lower_bound.md has the proof."""
