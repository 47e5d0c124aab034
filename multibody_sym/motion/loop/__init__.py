"""A run of one problem: in C or Python, in legs.

    problem        what is integrated and what comes of it: statistics, events, failures
    integrate      a problem integrated, in legs, with progress; the error of its end
    python_loop    the loop in Python
    native_loop    the loop in C
    native_problem, native_course    its problem; its run from mode to mode
    native_runs    runs that differ in numbers, by one call of C
"""
