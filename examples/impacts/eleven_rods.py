"""A particle strikes a chain of eleven rods in a half circle: the twin of eleven_rods.yaml in Python."""

import multibody_sym as mbs


def rod(k: int) -> mbs.Body:
    points = {"tip": [0, 0, 0]} if k == 1 else {}
    side = mbs.Surface(segment=[[0, 0, 0], ["l", 0, 0]], normal="y")
    return mbs.Body(
        mass="m",
        com=["l/2", 0, 0],
        inertia={"Izz": "m*l^2/12"},
        points={**points, "middle": ["l/2", 0, 0], "end": ["l", 0, 0]},
        surfaces={"side": side} if k == 7 else {},
    )


def hinge(k: int) -> mbs.Revolute:
    return mbs.Revolute(f"rod{k}.end", f"rod{k + 1}", axis="z", q=f"phi{k + 1}", initial={"q": "-turn"})


first = ["R*cos(b) - l*cos(5*turn)/2", "R*sin(b) - l*sin(5*turn)/2", "5*turn"]
particle = {"q": ["R*cos(a)", "R*sin(a)"], "u": ["-v*cos(a)", "-v*sin(a)"]}

system = mbs.System(
    "eleven_rods",
    description=(
        "Eleven equal rods lie on a smooth table along a half circle, each hinged to the next and turned by "
        "pi/10 against it. A particle as heavy as a rod strikes the centre of the fourth at right angles from"
        " outside, elastically. How does each rod move off, and which impulses do the hinges transmit?"
    ),
    gravity=[0, 0, 0],
    parameters={
        "m": {"value": "1 kg", "positive": True},
        "l": {"value": "1 m", "positive": True},
        "v": {"value": "1 m/s", "positive": True},
        "turn": "pi/10",
        "R": "l/(2*tan(turn/2))",  # of the circle through the centres of the rods, about the origin
        "b": "pi/2 + 5*turn",  # where on it the centre of the first rod is
        "a": "pi/2 + 2*turn",  # and that of the fourth, which the particle strikes
    },
    bodies={"particle": mbs.Body(mass="m"), **{f"rod{k}": rod(k) for k in range(1, 12)}},
    joints={
        "flight": mbs.PointJoint("ground", "particle", q=["x", "y"], initial=particle),
        "table": mbs.Planar("ground", "rod1", q=["x1", "y1", "phi1"], initial={"q": first}),
        **{f"hinge{k}": hinge(k) for k in range(1, 11)},
    },
    contacts={"meet": mbs.Contact(["rod1.tip", "rod7.side"], restitution=1)},
    impact=mbs.Impact(between=["particle", "rod4.middle"], normal=["cos(a)", "sin(a)", 0], restitution=1),
    simulation=mbs.Settings(t_end="15 s", rtol=1e-12, atol=1e-13),
)

if __name__ == "__main__":
    print(f"p = {mbs.solve(system).impact.impulses['impact']['normal']}")
