"""What is asked under `ask`: values now and later, extremes, for which value something happens.

    ask             the kinds of questions, and the answers in the order in which they name each other
    question        what a question is; numbers of runs with their errors; the motion that questions are about
    value, moment, path, speed, extremes, period, formula, find     one kind of question each
    from_runs       numbers of a motion from simulations
    courses, linear_systems     coordinates as formulas of time: alone, and coupled
    later_formulas  closed forms at a moment, along a formula of time or of a coordinate
    uniform_motion  closed forms where no acceleration changes
    named_answers   answers in the questions that name them; the equations of motion at any state
    zeros           roots of functions by their values alone
"""
