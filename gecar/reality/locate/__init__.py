"""Where simulation and reality part: by channel, regime of motion, time, and place on the floor."""
