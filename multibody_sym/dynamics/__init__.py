"""Dynamics: one formalism or theorem a file; each gives the same equations of motion of a mechanism."""
