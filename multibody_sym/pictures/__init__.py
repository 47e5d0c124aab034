"""What does an instant look like on a page?

    scene     what there is to see, as data: shapes and symbols on bodies, and what runs between them
    marks     how it looks: one file a kind of mark
    page      strokes and letters on a page, room for labels, and the files that they become
    draw, plots, notebook_figure     a scene as a figure; panels of curves

In: a Mechanism with the places of its bodies. Out: SVG, TikZ, PNG, PDF. Knows no runs and no derivation.
"""
