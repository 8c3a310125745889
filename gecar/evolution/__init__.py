"""Grammatical Evolution with an ask-and-tell interface: genomes, operators, selection, for any problem."""
