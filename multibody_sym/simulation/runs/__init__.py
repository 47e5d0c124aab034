"""Runs: what is ready to run, what results tell of it, the run itself, and how it is remembered between commands."""
