"""Problems of the field beside the robot: phenotypes and fitnesses to study Grammatical Evolution with."""
