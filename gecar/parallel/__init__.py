"""Calls on other processes and machines: executors, workers' start and end, and whole calls side by side."""
