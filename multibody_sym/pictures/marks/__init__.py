"""How things look: one file a kind of mark.

    sheet                a scene in a projection
    shapes, symbols      forms with a size in metres; pins, blocks and bobs in the page's size
    forces, ropes        arrows and their length, springs, dampers; ropes round their wheels
    supports, sliders    ground's triangles and hatching; rails and stops
    flows                jets, leaks, hoppers, mist, heaps; rockets, wagons, belts
    cones                cones of friction
    labels               names, lengths and angles
    place_symbols        where masses without a size stand
"""
