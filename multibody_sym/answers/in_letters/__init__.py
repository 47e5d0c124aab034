"""Formulas with named intermediate letters, where loops leave none in what is given alone."""
