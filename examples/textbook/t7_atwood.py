"""T7: Atwood's machine; the twin of t7_atwood.yaml in Python."""

import multibody_sym as mbs

g, m1, m2 = mbs.parameters("g m1 m2", ["10 m/s^2", "1 kg", "2 kg"], positive=True)

system = mbs.System(
    "t7_atwood",
    description=(
        "Atwood's machine: 1 kg and 2 kg hang on a light string over a fixed pulley. How far do they go in 5 "
        "s, and what is the tension?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"axle": [0, "50 m", 0]}),
        "left": mbs.Body(mass=m1),
        "right": mbs.Body(mass=m2),
    },
    joints={
        "line1": mbs.Prismatic("ground", "left", axis="y", q="y1"),
        "line2": mbs.Prismatic("ground", "right", axis="y", q="y2"),
    },
    constraints={"string": mbs.Rope(["left", "pulley", "right"])},
    pulleys={"pulley": mbs.Pulley("ground.axle")},
    ask={"displacement": mbs.Ask(of="right", after="5 s"), "tension": "tension(string)"},
    simulation=mbs.Settings(t_end="5 s"),
)

if __name__ == "__main__":
    for name, answer in mbs.solve(system).answers.items():
        print(f"{name} = {answer}")
