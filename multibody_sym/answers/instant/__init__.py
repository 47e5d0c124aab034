"""The solved start: forces and accelerations, conditions, letters of loops."""
