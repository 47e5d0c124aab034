"""From a System to what runs: settings, Programs, functions, exports.

    settings                settings of a run in numbers; default tolerances
    time_stepping           whether a run goes by time stepping, and by which step
    problem                 the initial value problem; how constraints are kept; Programs compiled or recalled
    records                 a system ready to run; names and units of its results
    functions, arguments    `compile`, `mass_matrix`, `inverse_dynamics`, `impact`; their arguments
    export                  `export`: source code, names.json, samples of its self test
    contact_code            what exported C needs to go from state to state of contacts; which models it holds
    fmu                     a system as an FMU: inputs from outside, fixed parameters, what is refused
"""
