"""Many runs: plan, rows, workers, tables.

    plan     `--vary a:b:n` and lists of values: the axes of a sweep, and the runs that they make
    rows     rows of runs; the journal from which a sweep is resumed
    study    `sweep`: workers, columns of the table, summary, figure
"""
