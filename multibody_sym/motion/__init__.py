"""How does it go on?

    simulate      `simulate`, `prepare`
    stepper       `Stepper`: a system stepped from outside
    function      `function`, `functions`: quantities of a system at a state, and their derivatives
    function_question    which function is asked for: names, options, the mode and start it needs, units
    function_values    arguments and types of results of functions; a Function as x' = f(t, x), and in other tools
    prepare       from a System to what runs: settings, Programs, functions, exports
    methods       integration methods as data that prove themselves
    integrator    one step, and what may happen in it
    loop          the run of one problem, in C or in Python to the same bits
    switching     contacts, ropes and friction: a run is its legs, each in one mode
    runs          a run from its start to its result; many together; recalled runs
    results       samples, plots, remarks of a run
    sweep         many runs as one table

In: a System and settings. Out: trajectories, functions, exports, tables. Nothing is asked of a run here.
"""
