"""Positions of rest: the search from many guesses, and of what holds one way only which of it is closed in each.

In: a mechanism at its start. Out: positions (nq,) with what is free in them and what is closed. `search` takes rows to
hold either way; `closings` runs it for each set of contacts, ropes and stops that may be closed.
"""
