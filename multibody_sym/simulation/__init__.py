"""Simulation: a declared system resolved, compiled, put at its start and run; what comes of it as a Trajectory."""
