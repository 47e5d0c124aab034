"""A run of one problem: in C or Python, in legs.

    problem        what is integrated and what comes of it: statistics, events, failures
    integrate      a problem integrated, in legs, with progress; the error of its end
    python_loop    the loop in Python
    native_loop    the loop in C, a problem as it reads it, and a run from mode to mode
"""
