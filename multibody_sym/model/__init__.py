"""What did the user say?

    fields, argument_checks, mistakes      fields; how public functions look at arguments; all mistakes at once
    parameters, bodies, joints, steps, constraints, forces, contacts_and_impacts, state_words, settings     the elements
    system                                 all that is declared under one name
    run_options                            what a call may change, for functions and the command line
    schema, urdf                           the keys of files, for editors; robots

In: calls from Python, or the parts of a file. Out: a frozen System. Nothing is resolved here: names are text, poses and
masses are as given.
"""
