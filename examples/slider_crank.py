"""A crank-slider whose loop is closed by a cut joint: the twin of slider_crank.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", ["9.81 m/s^2"])
r, l = mbs.parameters("r l", ["0.1 m", "0.3 m"], positive=True)
m1, m2, m3 = mbs.parameters("m1 m2 m3", ["1 kg", "500 g", "0.8 kg"])
(T0,) = mbs.parameters("T0", ["2 N*m"])
t, tau = mbs.variable("t"), mbs.variable("tau")


def bar(mass: mbs.Parameter, length: mbs.Parameter) -> mbs.Body:
    inertia = {"Izz": mass * length**2 / 12}
    return mbs.Body(mass=mass, com=[length / 2, 0, 0], inertia=inertia, points={"pin": [length, 0, 0]})


system = mbs.System(
    "slider_crank",
    description="A crank drives a slider through a rod, and joint C closes the loop.",
    gravity=[0, -g, 0],
    bodies={"crank": bar(m1, r), "rod": bar(m2, l), "slider": mbs.Body(mass=m3)},
    joints={
        "A": mbs.Revolute("ground", "crank", axis="z", q="phi", initial={"q": "30 deg", "u": 10, "known": True}),
        "B": mbs.Revolute("crank.pin", "rod", axis="z", q="psi"),
        "D": mbs.Prismatic("ground", "slider", axis="x", q="s"),
        "C": mbs.Revolute("rod.pin", "slider", axis="z", cut=True),
    },
    forces={"drive": mbs.Torque(tau, joint="A")},
    inputs={"tau": T0 * mbs.sin(2 * mbs.pi * t)},
    outputs={"pin_force": "fx(C)", "energy": "total_energy()"},
    simulation={"t_end": "2 s", "method": "dormand_prince", "rtol": 1e-9},
)

if __name__ == "__main__":
    print(mbs.check(system))
