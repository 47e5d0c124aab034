"""What was asked?

    solve, records     what holds at the start; Solution and its parts
    instant            M udot = f + H^T lambda, H udot = gamma in floats and in closed form, with its conditions
    impact             jumps of speeds and impulses: the mechanism at rest with the jumps of its rows for gamma
    ask                what is asked of the motion that follows, in closed form or from runs
    worked             the steps by which a book gets there
    free_bodies        every force on a body that is cut free

In: a System with questions. Out: a Solution. Numbers decide: a closed form whose value is not the number is left out.
There is no LaTeX and no layout here.
"""
