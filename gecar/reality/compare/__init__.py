"""A program's simulation compared with recordings of it."""
