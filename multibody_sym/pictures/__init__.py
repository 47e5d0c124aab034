"""What does an instant look like on a page?

    draw               a scene as a figure: view, scale, title, legend
    scene              what there is to see, as data: shapes and symbols on bodies, and what runs between them
    marks              how it looks: one file a kind of mark
    page               strokes and letters on a page, room for labels, and the files that they become
    plots              panels of curves
    diagrams           N, V and M along beams: signed areas to scale
    phase_portrait     curves of constant energy over a coordinate; Poinsot's ellipsoid of a body that turns freely
    notebook_figure    figures of matplotlib in notebooks

In: a Mechanism with the places of its bodies. Out: SVG, TikZ, PNG, PDF. Knows no runs and no derivation.
"""
