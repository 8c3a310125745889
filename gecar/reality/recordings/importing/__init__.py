"""What people have on disk, made into recordings: read, guess, repair, join."""
