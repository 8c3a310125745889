"""Calls on other processes and machines: executors, start and end of workers, calls in parallel."""
