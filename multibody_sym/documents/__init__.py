"""How is an answer written down?

    document           what documents consist of, and their writers: text, LaTeX, HTML
    derivation         the document of a derivation, and its data
    report             `report`: all answers on a system, and the blocks and writers that only reports have
    solution, runs     lines of text of `solve`; of runs
    analysis           of equilibria, modes, linearisations, ranges of rest
    notes              redundant constraints, withheld reactions, changed start values, in sentences
    formulas           LaTeX in lines, MathML, and what stands around a document
    notebook           results in notebook cells
    animation, draw    films and pages that play; figures

In: records of answers, trajectories, figures. Out: text, LaTeX, HTML.
"""
