"""Which robots drive the paper's own program (Fig. 6) as the paper says: `python -m benchmarks.paper_robot --help`."""
