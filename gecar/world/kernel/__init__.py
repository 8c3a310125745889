"""What is compiled: the robot's physics, its sensors, the interpreter, and drives made of them."""
