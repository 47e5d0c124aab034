"""What there is to see, as data.

    scene, stage      a scene built and placed; its system with places and sizes as floats, its view, its ground
    items             records of items, strands, dimensions, angles, arrows
    bodies, joints    bodies by shapes and surfaces, pulleys, contacts; signs of joints, lengths and angles named
    masses            forms by masses: rockets, wagons and belts; rods, wheels, balls, boxes and tops by moments
    letters           letters of masses and laws, what is asked and given, angles of slopes
    forces            springs, ropes and arrows of loads, of speeds at the start and of steady drives
"""
