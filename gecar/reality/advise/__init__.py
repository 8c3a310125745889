"""Notes of a verdict, and the recording to make next."""
