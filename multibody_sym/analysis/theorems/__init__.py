"""The general theorems: momentum, angular momentum and energy of a mechanism, and what it conserves.

In: a Mechanism with states, or with its start. Out: records of numbers, names and expressions.

    do forces and motion balance at a state      balance
    which quantities could stay constant         candidates: expressions with their exact rates
    which do, and by which symmetry              conserved, decided on 50 digits (precise)

Imports dynamics and everything below it.
"""
