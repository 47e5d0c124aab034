"""T3: three equal loads over a fixed pulley; the twin of t3_three_loads.yaml in Python."""

import multibody_sym as mbs

g, m = mbs.parameters("g m", ["10 m/s^2", "5 kg"], positive=True)

system = mbs.System(
    "t3_three_loads",
    description=(
        "Three equal loads hang over a fixed pulley, two on one side and one on the other. What is the "
        "acceleration, and how far do they go in 4 s?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"axle": [0, "40 m", 0]}),
        "upper": mbs.Body(mass=m),
        "lower": mbs.Body(mass=m),
        "single": mbs.Body(mass=m),
    },
    joints={
        "line1": mbs.Prismatic("ground", "upper", axis="y", q="y1"),
        "line2": mbs.Prismatic("ground", "lower", axis="y", q="y2", initial={"q": "-1 m"}),
        "line3": mbs.Prismatic("ground", "single", axis="y", q="y3"),
    },
    constraints={"string": mbs.Rope(["upper", "pulley", "single"]), "link": mbs.Rope(["upper", "lower"])},
    pulleys={"pulley": mbs.Pulley("ground.axle")},
    ask={"path": mbs.Ask(of="single", after="4 s")},
    simulation=mbs.Settings(t_end="4 s"),
)

if __name__ == "__main__":
    solution = mbs.solve(system)
    print("acceleration =", solution.accelerations["y3"])
    print("path =", solution.answers["path"])
