"""Notes beside a verdict, and the recording to make next."""
