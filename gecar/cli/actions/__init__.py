"""What commands do, where that is much: load, call, save, tell."""
