"""What adds up along a run: work and impulses as outputs, and the general theorems in integral form.

`fine` runs every stretch once more with many places in each step and integrates over them; `adding` tells the outputs
that name work and impulses; `verified` how well the theorems hold. Imports what `simulation` does, but no Trajectory.
"""
