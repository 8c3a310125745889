"""Selection of effects from the catalogue: screening, stepwise selection, cross-validation."""
