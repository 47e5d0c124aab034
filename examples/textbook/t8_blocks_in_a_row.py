"""T8: three blocks in a row on a smooth table, drawn by a load; the twin of t8_blocks_in_a_row.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", ["10 m/s^2"], positive=True)
masses = mbs.parameters("m1 m2 m3 m4", ["1 kg", "2 kg", "3 kg", "4 kg"], positive=True)
names = ("block1", "block2", "block3", "load")

system = mbs.System(
    "t8_blocks_in_a_row",
    description=(
        "Three blocks in a row on a smooth table are drawn by a load that hangs over the table's edge. What "
        "are the acceleration and the tensions?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"edge": ["4 m", 0, 0]}),
        **{name: mbs.Body(mass=mass) for name, mass in zip(names, masses, strict=True)},
    },
    joints={
        "table1": mbs.Prismatic("ground", "block1", axis="x", q="x1"),
        "table2": mbs.Prismatic("ground", "block2", axis="x", q="x2", initial={"q": "1 m"}),
        "table3": mbs.Prismatic("ground", "block3", axis="x", q="x3", initial={"q": "2 m"}),
        "line": mbs.Prismatic("ground.edge", "load", axis="-y", q="depth", q_label="y", initial={"q": "1 m"}),
    },
    constraints={
        "string1": mbs.Rope(["block1", "block2"]),
        "string2": mbs.Rope(["block2", "block3"]),
        "string3": mbs.Rope(["block3", "pulley", "load"]),
    },
    pulleys={"pulley": mbs.Pulley("ground.edge")},
    simulation=mbs.Settings(t_end="1 s"),
)

if __name__ == "__main__":
    solution = mbs.solve(system)
    print("acceleration =", solution.accelerations["x1"])
    for name in system.constraints:
        print(f"tension of {name} =", solution.reactions[name]["tension"])
