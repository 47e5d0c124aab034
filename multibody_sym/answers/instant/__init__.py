"""The solved start: forces and accelerations, conditions, letters of loops.

    instant      M udot = f + H^T lambda, H udot = gamma, in floats and in closed form; reactions by element
    states       states in sentences ("slides forward", "sticks"), friction needed, conditions of validity
    letters      letters of formulas, their values at the start, definitions of long terms
    loops        closed loops over letters: positions, speeds, and the forces that hold them
"""
