"""The evolution of robot programs: fitness, arrival under random conditions, evaluation."""
