"""A run's folder: configuration, history, best program, provenance, and the checkpoint for resuming."""
