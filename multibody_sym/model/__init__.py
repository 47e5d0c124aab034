"""What did the user say?

    fields                  kinds of fields: numbers, directions, choices, expressions; how each is read and written;
                            unknown and missing keys ("did you mean" is put together in errors)
    argument_checks         arguments of public functions
    mistakes                all mistakes of a file at once
    system                  all that is declared under one name, as a tree of the file and back
    parameters              parameters, inputs, tables, state variables (`states:`)
    bodies                  mass, inertia, shapes, points, frames, surfaces; ground's motion
    joints, steps           joints, their limits and start values; the elementary motions that they consist of
    constraints, forces     rods, ropes, gears, rolling, prescribed motion; springs, dampers, motors, gravitation
    contacts_and_impacts    contacts and `impact:`; refused coefficients that are written as numbers
    state_words             words and verbs of contact states ("sticks", "slide+"), moments, `stop`; `then:` sections
    settings                `ask` and `simulation:`; default method
    run_options             options that functions and the command line share, with their `--help`
    schema                  the JSON Schema, for editors
    urdf                    URDF read: links, joints, `<mimic>`; notices on what is left out

In: calls from Python, or the parts of a file. Out: a frozen System. Nothing is resolved here: names are text, poses and
masses are as given.
"""
