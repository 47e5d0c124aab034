"""One step in Python, and what may happen in it."""
