"""Models: what the user declares (System and its elements) and what follows from it (Mechanism)."""
