"""Grammatical Evolution: variation, fitness, evaluation, and the evolution itself as ask and tell."""
