"""Small motions: modes and amplitudes, in numbers and in formulas.

    modes           `modes`
    small_motion    the state, its spectrum and shapes, notes on what small motions leave out
    matrices        M, C and K as formulas; Routh's reduction by cyclic coordinates
    amplitude       the period of a motion of any amplitude
    record          Modes, roots of the spectrum, closed forms of frequencies
"""
