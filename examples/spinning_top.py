"""A top that precesses steadily: the twin of spinning_top.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, h, A, C = mbs.parameters("m h A C", ["0.3 kg", "4 cm", "3e-4 kg*m^2", "2e-4 kg*m^2"], positive=True)
tilt, precession = mbs.parameters("tilt precession", ["30 deg", 4])
needed = (m * g * h + (A + m * h**2) * precession**2 * mbs.cos(tilt)) / (C * precession)
(spin,) = mbs.parameters("spin", [needed])

system = mbs.System(
    "spinning_top",
    description=(
        "A fast top stands on its tip on a ball joint and is spun such that it precesses steadily. Its "
        "attitude is a quaternion."
    ),
    gravity=[0, 0, -g],
    bodies={"top": mbs.Body(mass=m, com=[0, 0, h], inertia={"Ixx": A, "Iyy": A, "Izz": C})},
    joints={
        "tip": mbs.Spherical(
            "ground",
            "top",
            initial={
                "q": [mbs.cos(tilt / 2), mbs.sin(tilt / 2), 0, 0],
                "u": [0, precession * mbs.sin(tilt), spin],
            },
        )
    },
    outputs={"height": "position(top, z)", "energy": "total_energy()", "vertical": "angular_momentum(z)"},
    simulation={"t_end": "3 s"},
)

if __name__ == "__main__":
    heights = mbs.simulate(system)["height"]
    print(f"the height changes by {heights.max() - heights.min():.1e} m")
