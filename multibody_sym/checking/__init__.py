"""Checking: whether a system is what its author means, and whether all routes to its equations agree.

In: a System. Out: a CheckReport: degrees of freedom, the rank of the constraints and what is redundant, the agreement
of every formalism with d'Alembert's equations at random states, the general theorems at the same states, and hints
about what a reader may not have meant.

Agreement is a ratio of a residual to the rounding that it may have; 1 is what good arithmetic leaves, 1e3 an error.

Imports analysis and dynamics, and simulation for what a run alone shows; writes nothing for people to read.
"""
