"""A block on a smooth incline, drawn by a load over a pulley; the twin of incline_pulley.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", ["10 m/s^2"], positive=True)
(alpha,) = mbs.parameters("alpha", ["30 deg"])
m1, m2, d, h = mbs.parameters("m1 m2 d h", ["2 kg", "3 kg", "2 m", "50 cm"], positive=True)

system = mbs.System(
    "incline_pulley",
    description=(
        "A block on a smooth incline is drawn up by a hanging load, over a pulley at the top. What are the "
        "acceleration, the tension and the normal force?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(frames={"incline": mbs.Frame(rotate=[mbs.Turn("z", alpha)])}),
        "block": mbs.Body(mass=m1),
        "load": mbs.Body(mass=m2),
    },
    joints={
        "plane": mbs.Prismatic("ground.incline", "block", axis="x", q="s", initial={"q": -d}),
        "line": mbs.Prismatic("ground", "load", axis="-y", q="depth", q_label="y", initial={"q": h}),
    },
    constraints={"string": mbs.Rope(["block", "pulley", "load"])},
    pulleys={"pulley": mbs.Pulley("ground")},
    ask={
        "normal_force": "fy(plane)",
        "speed_at_the_top": mbs.Ask(of="block", at={"s": 0}),
    },
    simulation=mbs.Settings(t_end="0.9 s"),
)

if __name__ == "__main__":
    solution = mbs.solve(system)
    print("acceleration =", solution.accelerations["s"])
    print("normal force =", solution.answers["normal_force"])
