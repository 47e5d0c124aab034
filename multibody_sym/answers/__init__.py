"""What was asked?

    solve              `solve`
    records            Solution and its parts
    instant            accelerations, forces, states of contacts and their conditions, in floats and in closed form
    impact             the answer about an impact: state, conditions, formulas, energy, centre of percussion
    impact_solution    the impact solved in floats and in closed form, and its steps
    ask                what is asked of the motion that follows, in closed form or from runs
    stages             several stages, each from the end of the one before
    worked             the steps by which a book gets there
    free_bodies        every force on a body that is cut free, as reports and `draw` with `forces` show it

In: a System with questions. Out: a Solution. Numbers decide: a closed form whose value is not the number is left out.
There is no LaTeX and no layout here.
"""
