"""Animations: pages that play, and films."""
