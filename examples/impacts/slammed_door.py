"""A door slammed against its stop: the twin of slammed_door.yaml in Python."""

import multibody_sym as mbs

m, b, c, w, e = mbs.parameters("m b c w e", ["20 kg", "0.9 m", "0.6 m", "2 rad/s", 0.3], positive=True)

system = mbs.System(
    "slammed_door",
    description="A door slams against a stop at a distance c from its hinge. Which impulse tears at the hinge?",
    gravity=[0, 0, 0],
    bodies={
        "ground": mbs.Body(points={"stop": [c, 0, 0]}),
        "door": mbs.Body(mass=m, com=[b / 2, 0, 0], inertia={"Izz": m * b**2 / 12}, points={"hit": [c, 0, 0]}),
    },
    joints={"hinge": mbs.Revolute("ground", "door", axis="z", q="phi", initial={"u": -w})},
    impact=mbs.Impact(between=["door.hit", "ground.stop"], normal="y", restitution=e),
)

if __name__ == "__main__":
    print(f"hinge = {mbs.solve(system).impact.joint_impulses['hinge']['fy']}")
