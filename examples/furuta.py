"""A Furuta pendulum: the twin of furuta.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
M, r, m, l = mbs.parameters("M r m l", ["0.25 kg", "20 cm", "0.1 kg", "30 cm"], positive=True)
T0, w = mbs.parameters("T0 w", ["0.15 N*m", 6])
t, tau = mbs.variable("t"), mbs.variable("tau")
across = m * l**2 / 12

system = mbs.System(
    "furuta",
    description="A Furuta pendulum: an arm turned to and fro by a motor carries a rod that swings across it.",
    gravity=[0, 0, -g],
    bodies={
        "arm": mbs.Body(shape={"rod": r, "mass": M}, points={"tip": [r, 0, 0]}),
        "rod": mbs.Body(mass=m, com=[0, 0, -l / 2], inertia={"Ixx": across, "Iyy": across}),
    },
    joints={
        "shaft": mbs.Revolute("ground", "arm", axis="z", q="phi"),
        "hinge": mbs.Revolute("arm.tip", "rod", axis="x", q="theta", initial={"q": "170 deg"}),
    },
    inputs={"tau": T0 * mbs.cos(w * t)},
    forces={"motor": mbs.Torque(tau, joint="shaft")},
    outputs={"height": "position(rod, z)", "energy": "total_energy()"},
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    print(mbs.derive(system, method="lagrange"))
