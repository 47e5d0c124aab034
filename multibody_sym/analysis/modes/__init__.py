"""Small motions: modes and amplitudes, in numbers and in formulas.

    modes           `modes`; the period of a motion of any amplitude
    small_motion    the state, its spectrum and shapes; formulas of omega and T, the shortest form; notes on what
                    small motions leave out
    matrices        M, C and K as formulas; Routh's reduction by cyclic coordinates
    forced          steady motions under a harmonic input: amplitudes and lags, resonances
    record          Modes, roots of the characteristic polynomial in closed form
"""
