"""How is an answer written down?

    document           what documents consist of, and their writers: text, LaTeX, HTML
    derivation         the document of a derivation, and its data
    report             all answers on a system: the sections, and the blocks and writers that only reports have
    solution, analysis, runs, notes     lines of text of the other answers
    formulas           LaTeX in lines, MathML, and what stands around a document
    notebook, animation, draw           cells, films, figures

In: records of answers, trajectories, figures. Out: text, LaTeX, HTML.
"""
