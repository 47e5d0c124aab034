"""Analysis: questions about a mechanism that equations answer without a simulation.

In: a System or Mechanism with its start or with states. Out: records of numbers.

    how do small deviations go on      deviations, linearization (x' = A x + B w), steadiness (is A constant?), periodic
    where can it rest                  equilibrium; which positions are the same: places; are these all: all_rest
    at which values of a parameter    rest
    do forces and motion balance       theorems (power, momentum, angular momentum; what is conserved)
    how well does a route agree        agreement, against reference: d'Alembert's principle once more, body by body
    what may a reader not have meant   limits passed, slipped_wheels, springs_passed

Imports dynamics and, to call Programs fast, runtime; knows no Trajectory and writes nothing for people to read.
"""
