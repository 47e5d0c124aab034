"""A coin that rolls in a circle: the twin of rolling_coin.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", ["9.81 m/s^2"])
(r,) = mbs.parameters("r", ["12 mm"], positive=True)
m, lean0, turn = mbs.parameters("m lean0 turn", ["8 g", "70 deg", "10 rad/s"])
steady = "-5/6*turn*cos(lean0) - 2/3*g/r*cos(lean0)/(turn*sin(lean0))"
(spin,) = mbs.parameters("spin", [steady])
position = [0, 0, r * mbs.sin(lean0), 0, lean0, 0]
speed = [-r * (spin + turn * mbs.cos(lean0)), 0, 0, turn, 0, spin]

system = mbs.System(
    "rolling_coin",
    description="A coin rolls on a table without slip, leaning, and goes round in a circle: a disc with a sharp rim.",
    gravity=[0, 0, -g],
    bodies={
        "ground": mbs.Body(surfaces={"table": {"plane": [0, 0, 0], "normal": "z"}}),
        "coin": mbs.Body(shape={"disc": r, "mass": m}, surfaces={"rim": {"disc": r, "axis": "z"}}),
    },
    joints={
        "ride": mbs.Free(
            "ground",
            "coin",
            angles="zxz",
            q=["x", "y", "z", "heading", "lean", "roll"],
            initial={"q": position, "u": speed},
        )
    },
    constraints={"contact": mbs.Rolling("coin.rim", "ground.table")},
    outputs={"normal_force": "multiplier(contact.n)", "energy": "total_energy()"},
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    print(mbs.simulate(system))
