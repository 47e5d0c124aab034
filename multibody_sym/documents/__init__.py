"""How is it told?

    derivation, solution, worked, analysis, runs, notes     text and LaTeX of what was found
    formulas           LaTeX, and MathML for pages
    report, notebook, animation, draw     pages to hand out, cells, films, figures

In: records of answers, trajectories, figures. Out: text, LaTeX, HTML. What is told was found below; here it is put into
words.
"""
