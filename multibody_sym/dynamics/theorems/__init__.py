"""Balances of momentum and energy, and what is conserved."""
