"""A run of one problem: in C or Python, in legs."""
