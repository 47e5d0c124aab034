"""How does it go on?

    methods, integrator     methods as data that prove themselves; one step, and what may happen in it
    loop                    the run of one problem, in C or in Python to the same bits
    prepare                 from a System to what runs: settings, Programs, functions, exports
    switching               what holds one way only: a run is its legs, each in one mode
    simulate, runs, results     a run from its start to its end; what it leaves
    sweep                   many runs as one table

In: a System and settings. Out: trajectories, functions, exports, tables. Nothing is asked of a run here.
"""
