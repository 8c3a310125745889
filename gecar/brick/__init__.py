"""Programs for the brick: what a person copies to a LEGO EV3 and starts there."""
