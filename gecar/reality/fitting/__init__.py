"""Fits of effects to residuals: coordinates, starting values, models, nuisances."""
