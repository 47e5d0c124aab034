"""How is an answer written down?

    document           what documents consist of, and their writers: text, LaTeX, HTML
    derivation         the document of a derivation, and its data
    report             `report`: a system as a page or as LaTeX; exercises and sheets of answers
    report_content     all answers on a system, what its description asks, what a report says in which order
    letters            names, conditions and sentences in the letters of a book
    solution, runs     lines of text of `solve`; of runs
    analysis           of equilibria, modes, linearisations, ranges of rest
    notes              redundant constraints, withheld reactions, changed start values, in sentences
    formulas           LaTeX in lines, MathML, and what stands around a document
    notebook           results in notebook cells
    animation, draw    films and pages that play; figures
    diagrams           N, V and M of beams, plans of velocities, Poinsot's ellipsoid

In: records of answers, trajectories, figures. Out: text, LaTeX, HTML.
"""
