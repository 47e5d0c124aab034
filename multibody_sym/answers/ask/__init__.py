"""What is asked under `ask`: values now and later, extremes, for which value something happens or is best.

    ask                        kinds of questions; answers in the order in which they name each other
    question                   what a question is; the motion that it is about; numbers of runs with their errors
    working                    notes on an answer, the lines by which a book gets there, equations solved line by line
    number_questions           time, speed, path, value, period, advance: one number each; steps of structures at rest
    formula_questions          formulas of time, and of a coordinate or speed; `limit`, `series`: formulas near a place
    forced_questions           amplitude, phase, resonance under a harmonic input; decrement and damping ratio
    extremes                   `max`, `min`: largest and least values
    sections                   axial force, shear force and bending moment of beams
    varied                     answers as functions of a parameter or start value
    kinematics                 velocity and acceleration of a point, instantaneous centre of a body, from body to body
    phase_space                action and its frequency, Poisson brackets, canonical transformations
    principal_axes             principal moments of inertia of a body, or of several
    find                       `find` .. `so`, `least`, `greatest`: for which value an equation holds, an answer is so
    from_runs                  numbers of a motion from simulations
    uniform_motion             closed forms where no acceleration changes
    courses, linear_systems    coordinates as formulas of time: alone, and coupled
    later_formulas             closed forms at a moment, along formulas of time, of a coordinate or of a speed; bounces
    energy_integral            one freedom by its place: energy, work, momenta, periods; u' = f(u) by separation
    named_answers              answers in the questions that name them; the equations of motion at any state
"""
