"""A bead on a rotating hoop: the twin of bead_on_hoop.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
R, m = mbs.parameters("R m", ["30 cm", "100 g"], positive=True)
w, start = mbs.parameters("w start", [8, "2 deg"])

system = mbs.System(
    "bead_on_hoop",
    description="A bead slides on a hoop that a motor turns about the vertical. Turned fast enough, the bead climbs.",
    gravity=[0, 0, -g],
    bodies={
        "hoop": mbs.Body(surfaces={"wire": {"disc": R, "axis": "x", "inside": True}}),
        "bead": mbs.Body(mass=m, com=[0, 0, -R]),
    },
    joints={
        "axle": mbs.Revolute("ground", "hoop", axis="z", motion=w * mbs.t),
        "slide": mbs.Revolute("hoop", "bead", axis="x", q="theta", initial={"q": start}),
    },
    outputs={
        "motor": "mz(axle)",
        "energy": "total_energy()",
        "jacobi": "total_energy() - w*angular_momentum(z)",
    },
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    print(mbs.derive(system, method="lagrange"))
