"""One file a command.

    new, import_, schema     a model file from an example or URDF; the schema for editors
    check, solve, derive     checks; the start; equations in symbols
    simulate, sweep          one run; many runs (`--vary` is split here and read in motion/sweep/plan.py)
    equilibrium, linearize, modes    positions of rest; A, B, eigenvalues; small oscillations
    draw, animate, live, report    figures; films and pages that play; pages that compute; documents
    export, explain          source code; the page of an error
"""
