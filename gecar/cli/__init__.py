"""Commands: parse, load, call, save; one module each."""
