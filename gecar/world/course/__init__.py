"""Courses: files, tiles, floor, driving order, and lower bounds on the time to GOAL."""
