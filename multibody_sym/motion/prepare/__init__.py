"""From a System to what runs: settings, Programs, functions, exports.

    settings                settings of a run in numbers; default tolerances; which runs go by time stepping
    problem                 the initial value problem; constraints kept by projection, or by Baumgarte's terms, which
                            dynamics/programs writes; Programs compiled or recalled
    records                 a system ready to run; names and units of its results
    functions               `compile`, `mass_matrix`, `inverse_dynamics`, `impact`
    export                  `export`: source code, names.json, samples of its self test
    fmu                     exported models that run by themselves: C from state to state of contacts, FMUs
"""
