"""The robot, its course, and the physics between them."""
