"""Solving: equations of exact quotients for one symbol."""
