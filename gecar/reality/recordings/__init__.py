"""Recordings of a real robot: read, written, imported from other tools' logs, and set aside for judging."""
