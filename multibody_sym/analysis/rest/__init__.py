"""Ranges of rest: for which values of a parameter a system can stay at rest in its declared position.

Rest is possible where forces exist that are in balance, udot = 0, and that contacts, ropes and friction can exert.
`statics` makes these conditions, `ranges` finds the values at which they hold together and what gives way beyond them,
`cone_ends` the ends in space, `exact_ends` their closed forms; `range_of_rest` answers.
"""
