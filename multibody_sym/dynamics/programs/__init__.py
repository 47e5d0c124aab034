"""The equations as Programs: named, shaped inputs and outputs.

    system             the Programs of a run: derivatives with Baumgarte's terms, projections, energy, outputs, events
    every_mode         the same for all modes, Baumgarte's terms too: numbers say which rows act
    law_programs       the problem of contact laws: all rows, gaps and rates
    reactions          forces of joints, ropes and contacts; switching functions, which end a mode
    quantities         positions, reactions, momenta that outputs name; events: `stop`, kinks of inputs (`min`, `where`)
    sections           axial force, shear force and bending moment, by equilibrium of the part that is cut off
    state_functions    the Programs of `function`, one entry a name; mass matrix, inverse and hybrid dynamics, momenta
    function_derivatives    derivatives of functions, alone or together with their values
    repeated_bodies, repeated_contacts    loops over like bodies; over contacts of a kind
"""
