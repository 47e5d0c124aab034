"""Answers: what holds at the given instant, and what an exercise asks of the motion that follows.

In: a System with what it asks (`ask`). Out: a Solution (`solution`): accelerations, reactions and answers, each a
number and, where there is one, a closed form, with the conditions under which all this holds. `instant` solves

    M udot = f + H^T lambda,  H udot = gamma

in floats; `closed_form` solves it again over exact quotients, at the state that `symbolic_start` finds for the start in
the names of the model, or any other (`symbolic_state`). `questions` answers what is asked, at the start or of what
follows, in closed form or from runs. `solve` puts it together.
`range_of_rest` answers at which values of a parameter there is rest, with ends in closed form (`exact_rest`).

Numbers decide: a closed form whose value is not the number is left out. Imports simulation, analysis and what lies
below; writes nothing for people to read.
"""
