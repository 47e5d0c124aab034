"""A run from its start to its result, one or many of a family, kept for the next command.

    run            a run integrated; errors of a run that fails
    failures       why a run ended early, in the names of the model
    contact_steps  runs by time stepping: all contacts of a step at once (`moreau`)
    held_inputs    inputs that are held, as parameters; sampled from functions
    staged         runs of several stages, as one trajectory
    family         runs that differ in numbers: compiled once, started together, integrated by one call of C
    replay         runs recalled from the cache
"""
