"""How are an expression, a unit, a table and a tree of YAML read and written?

    tokens, parser    the expression language, numbers with units ("9.81 m/s^2"); bounds on length, names and nesting
    printer           expressions written
    units             factors and dimensions of units of measurement
    values            numbers as text, with the digits that hold
    yaml_tree         trees with the place of every word; bounds on size and depth of files; aliases refused
    files, tables     files that are never harmed; tables of results (CSV, NPZ, Parquet)

In: text. Out: Nodes, units, tables and trees, each with line and column, and back. What a file means is not known here.
"""
