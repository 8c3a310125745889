"""A run's folder: its configuration, history, best program, provenance, and the checkpoint it goes on from."""
