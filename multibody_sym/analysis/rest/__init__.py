"""Ranges of rest: for which values of a parameter a system can stay at rest in its declared position.

Rest is possible where forces exist that are in balance, udot = 0, and that contacts, ropes and friction can exert:
normal forces and tensions >= 0, friction within its limits. `statics` makes these conditions, `ranges` finds the values
at which they hold together, `causes` names what gives way beyond them.
Imports dynamics and everything below it.
"""
