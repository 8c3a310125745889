"""Grammatical Evolution as ask and tell: genomes, operators, selection; what is evolved is the caller's."""
