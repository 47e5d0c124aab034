"""Strokes, letters and places on a page, and the files that they become."""
