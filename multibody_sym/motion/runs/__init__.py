"""A run from its start to its result, one or many of a family, kept for the next command."""
