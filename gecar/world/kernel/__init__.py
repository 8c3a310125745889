"""Compiled code: the robot's physics, its sensors, the interpreter, and whole drives."""
