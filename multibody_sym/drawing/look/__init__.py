"""How each thing of a scene looks: one function a form, a symbol, a strand and an arrow, in tables by kind.

What comes in: a `Sheet`, the scene placed at a state and the projection. What goes out: marks in points of the page,
and wishes of labels, whose places the layout finds.
"""
