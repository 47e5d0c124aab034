"""Ranges of rest: for which values of a parameter a system can stay at rest in its declared position.

    range_of_rest    `range_of_rest`, `least_for_motion`
    statics          conditions of rest: forces in balance, each within its limits
    ranges           intervals of values at which they hold, and the limits reached at their ends, in words
    ends             ends on circles of friction in space; ends in closed form
"""
