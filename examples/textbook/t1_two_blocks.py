"""T1: two blocks joined by a string are pulled apart; the twin of t1_two_blocks.yaml in Python."""

import multibody_sym as mbs

m1, m2, F1, F2 = mbs.parameters("m1 m2 F1 F2", ["0.2 kg", "0.3 kg", "0.1 N", "0.6 N"], positive=True)

system = mbs.System(
    "t1_two_blocks",
    description=(
        "Two blocks joined by a string on a smooth table are pulled apart. What are the acceleration and the "
        "tension?"
    ),
    bodies={"left": mbs.Body(mass=m1), "right": mbs.Body(mass=m2)},
    joints={
        "table1": mbs.Prismatic("ground", "left", axis="x", q="x1"),
        "table2": mbs.Prismatic("ground", "right", axis="x", q="x2", initial={"q": "0.5 m"}),
    },
    forces={"pull1": mbs.Force("left", [-F1, 0, 0]), "pull2": mbs.Force("right", [F2, 0, 0])},
    constraints={"string": mbs.Rope(["left", "right"])},
)

if __name__ == "__main__":
    solution = mbs.solve(system)
    print("acceleration =", solution.accelerations["x2"])
    print("tension =", solution.reactions["string"]["tension"])
