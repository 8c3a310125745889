"""A description, in state variables, of what nothing in the catalogue explains."""
