"""How things look: one file a kind of mark.

    sheet             a scene in a projection; where masses without a size stand
    shapes, symbols   forms with a size in metres, rails and stops; pins, blocks, bobs and flows in the page's size
    forces, ropes     arrows, springs, dampers, cones of friction; ropes round their wheels, pulleys, supports
    labels            names, lengths and angles
"""
