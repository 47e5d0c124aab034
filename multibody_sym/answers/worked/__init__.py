"""Worked steps: balances of bodies, elimination, states that contradict themselves."""
