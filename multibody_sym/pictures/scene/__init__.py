"""What there is to see, as data.

    scene, stage      a scene built and placed; its system with places and sizes as floats, its view
    items             records of items, strands, dimensions, angles, arrows
    bodies, joints    bodies by shapes and surfaces, pulleys, contacts; signs of joints, lengths and angles named
    forces            springs, ropes and arrows of loads
"""
