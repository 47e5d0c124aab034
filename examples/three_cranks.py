"""A table on three parallel cranks: the twin of three_cranks.yaml in Python."""

import multibody_sym as mbs

r, l, m, M, g = mbs.parameters("r l m M g", ["0.3 m", "0.5 m", "1 kg", "4 kg", "9.81 m/s^2"])
places = {"b": [l, 0, 0], "c": [2 * l, 0, 0]}
crank = mbs.Body(shape={"rod": r, "mass": m}, points={"end": [r, 0, 0]})

system = mbs.System(
    "three_cranks",
    description="A table stands on three parallel cranks, one more than it takes to hold it.",
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points=places),
        **{f"crank{k}": crank for k in (1, 2, 3)},
        "table": mbs.Body(shape={"rod": 2 * l, "mass": M}, points=places),
    },
    joints={
        "A1": mbs.Revolute("ground", "crank1", axis="z", q="phi", initial={"q": "-60 deg", "u": 1, "known": True}),
        "A2": mbs.Revolute("ground.b", "crank2", axis="z", q="phi2", initial={"q": "-60 deg"}),
        "A3": mbs.Revolute("ground.c", "crank3", axis="z", q="phi3", initial={"q": "-60 deg"}),
        "B1": mbs.Revolute("crank1.end", "table", axis="z", q="psi", initial={"q": "60 deg"}),
        "B2": mbs.Revolute("crank2.end", "table.b", axis="z", cut=True),
        "B3": mbs.Revolute("crank3.end", "table.c", axis="z", cut=True),
    },
    outputs={"height": "position(table, y)"},
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    print("not unique:", mbs.check(system).not_unique)
