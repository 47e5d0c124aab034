"""Small motions: modes and amplitudes, in numbers and in formulas."""
