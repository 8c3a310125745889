"""Grammars, the mapping of genomes to programs, and the robot's language."""
