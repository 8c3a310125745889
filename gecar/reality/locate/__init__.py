"""Where simulation and reality differ: by channel, regime of motion, time, and place on the floor."""
