"""The work of the larger commands, one module each: load, run, save and report."""
