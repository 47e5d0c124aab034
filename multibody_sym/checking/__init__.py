"""Checking: whether a system is what its author means, and whether all routes to its equations agree.

In: a System. Out: a CheckReport (`check`): degrees of freedom, the rank of the constraints, what is redundant and which
forces are not unique, how well each formalism satisfies d'Alembert's equations at the start and at random states around
it, the general theorems at the same states, and hints about what the author may not have meant.

Agreement is a ratio of a residual to the rounding that it may have: up to 10 on trees and 100 with constraints is
rounding, wrong equations give 1e10 and more. Where they disagree, constraints that contradict each other are named.

Imports analysis, dynamics and what lies below; runs nothing and writes nothing for people to read.
"""
