"""Curves that guide: what acts across them, and where bodies touch them."""
