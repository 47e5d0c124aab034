"""Impacts as problems: what follows, under which conditions, with the steps."""
