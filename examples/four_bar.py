"""A crank-rocker: the twin of four_bar.yaml in Python."""

import multibody_sym as mbs

a, b, c, d = mbs.parameters("a b c d", ["0.2 m", "0.5 m", "0.4 m", "0.5 m"])
rho, g, torque = mbs.parameters("rho g torque", ["2 kg/m", "9.81 m/s^2", "0.5 N*m"])


def bar(length: mbs.Parameter) -> mbs.Body:
    return mbs.Body(shape={"rod": length, "mass": rho * length}, points={"end": [length, 0, 0]})


system = mbs.System(
    "four_bar",
    description="A crank-rocker: four bars in a loop; the crank turns round, the rocker swings.",
    gravity=[0, -g, 0],
    bodies={"ground": mbs.Body(points={"pivot": [d, 0, 0]}), "crank": bar(a), "coupler": bar(b), "rocker": bar(c)},
    joints={
        "A": mbs.Revolute(
            "ground", "crank", axis="z", q="crank_angle", initial={"q": "60 deg", "u": 10, "known": True}
        ),
        "B": mbs.Revolute("crank.end", "coupler", axis="z", q="coupler_angle", initial={"q": "-30 deg"}),
        "D": mbs.Revolute("ground.pivot", "rocker", axis="z", q="rocker_angle", initial={"q": "100 deg"}),
        "C": mbs.Revolute("coupler.end", "rocker.end", axis="z"),
    },
    forces={"motor": mbs.Torque(torque * mbs.cos(mbs.t), joint="A")},
    outputs={"pin_x": "fx(C)", "pin_y": "fy(C)", "tip": "position(coupler.end, y)"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    print(mbs.check(system))
