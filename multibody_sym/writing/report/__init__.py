"""Reports: what is known of a system, as one file to hand in: HTML that needs nothing beside it, or LaTeX.

`findings` asks the questions: figure, equations, the solution at the start step by step, the motion, what is redundant.
`html` and `latex` write them; a part that cannot be had says why, and the others stand.
"""
