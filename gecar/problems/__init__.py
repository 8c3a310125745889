"""Benchmark problems of Grammatical Evolution other than the robot: phenotypes and fitnesses."""
