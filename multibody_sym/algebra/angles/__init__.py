"""How sines and cosines are written: tangents, and the multiples of angles that a model names."""
