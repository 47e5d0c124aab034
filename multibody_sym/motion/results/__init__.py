"""What a run leaves: samples, integrals, remarks, plots.

    trajectory       Trajectory: samples, end, drift, cost of a run; unphysical or undefined states: ropes that push
    samples          columns of a motion's table, their names and order; states of contacts, energy account
    integrals        a run looked at once more: work and impulses, theorems, any time, limits and edges passed
    plot             panels, curves and marks of a plot
"""
