"""How are an expression, a unit, a table and a tree of YAML read and written?

    tokens, parser, printer     the model's own language
    units, values               units of measurement; numbers as text, with the digits that hold
    yaml_tree, files, tables    trees with the place of every word; files that are never harmed; tables of results

In: text. Out: Nodes, units, tables and trees, each with line and column, and back. What a file means is not known here.
"""
