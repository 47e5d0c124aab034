"""How is an answer written down?

    document           what documents consist of, and their writers: text, LaTeX, HTML
    derivation         the document of a derivation, and its data
    report             `report`: a system as a page or as LaTeX; exercises and sheets of answers
    report_findings    all answers on a system, and what its description asks
    report_content     what a report says, in which order
    report_pages       its writers: HTML for screen and paper, LaTeX
    exercise           other round numbers of the parameters, the same for a seed
    letters            names, conditions and sentences in the letters of a book
    solution, runs     lines of text of `solve`; of runs
    analysis           of equilibria, modes, linearisations, ranges of rest
    notes              redundant constraints, withheld reactions, changed start values, in sentences
    formulas           LaTeX in lines, MathML, and what stands around a document
    notebook           results in notebook cells
    animation, draw    films and pages that play; figures
    section_diagrams   N, V and M of the beams that a system asks about
    polhodes           Poinsot's ellipsoid of a body that turns freely
    motion_diagrams    plans of the velocities and accelerations that it asks about

In: records of answers, trajectories, figures. Out: text, LaTeX, HTML.
"""
