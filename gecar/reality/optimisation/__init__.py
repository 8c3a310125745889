"""General minimisers: robust least squares, and CMA-ES for rough cost functions."""
