"""Curves that are touched or guide points: the feet that follow where, and the rows that make them follow."""
