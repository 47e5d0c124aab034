"""Answers: what holds at the given instant, and what an exercise asks of the motion that follows.

In: a System with `ask`. Out: a Solution: accelerations, reactions and tensions, each as a number and, where there is
one, as a closed form with the conditions under which it holds. `instant` solves

    M udot = f + H^T lambda,  H udot = gamma

in floats; `symbolic_state` and `closed_form` solve it again in symbols at the same state; `uniform_motion` and
`simulated_motion` answer questions of paths, times and speeds.

Numbers decide, formulas must agree with them. Imports simulation and analysis; writes nothing for people to read.
"""
