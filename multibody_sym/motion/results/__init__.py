"""What a run leaves: samples, integrals, remarks, plots.

    trajectory       Trajectory: samples, end, drift, cost of a run; unphysical or undefined states: ropes that push
    between          a run at any time, by dense output
    samples          columns of a motion's table, their names and order; states of contacts, energy account
    integrals        work and impulses from the start; balances of the theorems
    limits_passed    limits of joints that a motion passes, edges of boxes that it crosses
    plot             panels, curves and marks of a plot
"""
