"""Integrators: methods as data that check themselves, and the stepping loop in plain Python for any f(t, x)."""
