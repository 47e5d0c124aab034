"""What is asked under `ask`: values now and later, extremes, for which value something happens or is best.

    ask                        kinds of questions; answers in the order in which they name each other
    question                   what a question is; the motion that it is about; numbers of runs with their errors
    working                    notes on an answer, and the lines by which a book gets there
    number_questions           time, speed, path, value, period, advance: one number each
    formula_questions          formulas of time, and of a coordinate or speed
    forced_questions           amplitude, phase, resonance under a harmonic input; decrement and damping ratio
    forced_steps               the steps of these: equations, the motion put in, its amplitude and phase
    extremes                   `max`, `min`: largest and least values
    sections                   axial force, shear force and bending moment of beams
    varied                     answers as functions of a parameter or start value
    kinematics                 velocity and acceleration of a point, instantaneous centre of a body, from body to body
    statics                    virtual work of a structure without one support; why a force is not unique
    action                     action of a coordinate, the frequency of its angle
    phase_space                Poisson brackets, canonical transformations
    principal_axes             principal moments of inertia of a body, or of several
    find                       `find` .. `so`: the value for which an equation holds
    solving                    an equation solved for a letter line by line: factors, squares, tangents
    best                       `find` .. `least`, `greatest`: the value for which an answer is so
    expansions                 `limit`, `series`: formulas near a place
    from_runs                  numbers of a motion from simulations
    uniform_motion             closed forms where no acceleration changes
    courses, linear_systems    coordinates as formulas of time: alone, and coupled
    later_formulas             closed forms at a moment, along formulas of time, of a coordinate or of a speed
    bounces                    infinitely many bounces of a contact, as geometric series
    energy_integral            one freedom by its place: energy, work, momenta, periods; u' = f(u) by separation
    named_answers              answers in the questions that name them; the equations of motion at any state
"""
