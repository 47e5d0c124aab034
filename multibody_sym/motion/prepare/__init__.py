"""From a System to what runs: settings, Programs, functions, exports.

    settings                settings of a run in numbers
    problem                 the initial value problem; how constraints are kept
    programs                Programs compiled or recalled
    records                 a system ready to run
    run_labels              names and units of results; what to look for in a run
    functions, arguments    mass matrix, inverse dynamics, impacts as functions; their arguments
    export                  `export`: source code, names.json, samples of its self test
"""
