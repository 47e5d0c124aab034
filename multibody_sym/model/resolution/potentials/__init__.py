"""Potentials: the names that their expressions may use beside the model's, and the loads that they make.

`own_names` puts leaves in the place of `distance`, `distance_rate` (between points) and x, y, z (of a place), before
expressions are verified; `loads` makes the loads, each with its energy and the slopes that are its force.
"""
