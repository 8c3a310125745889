"""Courses: files, tiles, floor, driving order, and how fast they can be driven."""
