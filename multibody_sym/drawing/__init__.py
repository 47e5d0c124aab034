"""Pictures of mechanisms: a scene seen from a direction, laid out on a page, written as SVG, TikZ, PNG or PDF.

What comes in: a `Scene` with the places of its bodies (`scene/`). What goes out: a `Picture` of lines and letters in
points of a page (72 to the inch, y up), and its bytes. `look/` draws one symbol after the other, `layout` finds places
for labels and dimensions, each backend escapes what users wrote in one place of its own. Neither sympy nor matplotlib
is imported on the way to SVG and TikZ; runs and trajectories are not known here.
"""
