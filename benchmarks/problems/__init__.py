"""gecar beside another library of Grammatical Evolution, on problems of the field: `python -m benchmarks.problems`.

The peer is GRAPE (de Lima et al., Signals 3(3), 2022), which is of PonyGE2's lineage and stands on DEAP;
PonyGE2 itself is in no package index. Both have the same grammar, population, generations and rates, and call the same
fitness. Runs take turns, so that what else the machine does costs both the same; times are of the processor.
"""
