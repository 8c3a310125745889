"""A program's simulation beside recordings of it."""
