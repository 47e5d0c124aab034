"""What there is to see, as data.

    scene, stage      a scene built and placed; its system with places and sizes as floats, its view
    items             records of items, strands, dimensions, angles, arrows
    bodies, joints    bodies by shapes and surfaces, pulleys, contacts; signs of joints, lengths and angles named
    moments           rods, wheels, balls, boxes and tops by moments of inertia
    flows             masses that vary, and the rockets, wagons and belts that they make
    letters           letters of masses and laws, what is asked and given, angles of slopes
    touched           ground where bodies touch it: supports of beams, stairs, what an impact strikes
    forces            springs, ropes and arrows of loads
    speeds            arrows of speeds at the start and of steady drives
"""
