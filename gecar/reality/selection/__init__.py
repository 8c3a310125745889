"""Which effects of the catalogue the recordings ask for: screening, stepwise selection, cross-validation."""
