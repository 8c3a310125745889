"""Programs for the robot: fitness, arrival under drawn conditions, evaluation."""
