"""Ropes: the rows of their runs, and the wheels that turn with them."""
