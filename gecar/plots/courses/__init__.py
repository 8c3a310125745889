"""Pictures of courses and robots, on screen and on paper."""
