"""Recordings of a real robot: reading, writing, importing logs, and holding out recordings for validation."""
