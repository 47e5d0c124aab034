"""A gyroscope in gimbals: the twin of gyroscope.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, h, C, A, ring = mbs.parameters(
    "m h C A ring", ["0.2 kg", "5 cm", "2e-4 kg*m^2", "1.2e-4 kg*m^2", "1e-4 kg*m^2"], positive=True
)
(precession,) = mbs.parameters("precession", [2])
(spin,) = mbs.parameters("spin", [m * g * h / (C * precession)])
of_ring = {"Ixx": ring, "Iyy": 2 * ring, "Izz": ring}

system = mbs.System(
    "gyroscope",
    description=(
        "A gyroscope in gimbals has a weight on the inner ring. Instead of tipping over, it turns about the "
        "vertical."
    ),
    gravity=[0, 0, -g],
    bodies={
        "outer": mbs.Body(inertia=of_ring, surfaces={"ring": {"disc": "4.2 cm", "axis": "y", "inside": True}}),
        "inner": mbs.Body(
            mass=m,
            com=[0, 0, h],
            inertia=of_ring,
            surfaces={"ring": {"disc": "3.4 cm", "axis": "y", "inside": True}},
        ),
        "rotor": mbs.Body(inertia={"Ixx": A, "Iyy": A, "Izz": C}, surfaces={"rim": {"disc": "2.6 cm"}}),
    },
    joints={
        "frame": mbs.Revolute("ground", "outer", axis="z", q="psi", initial={"u": precession}),
        "gimbal": mbs.Revolute("outer", "inner", axis="x", q="theta", initial={"q": "90 deg"}),
        "axle": mbs.Revolute("inner", "rotor", axis="z", q="phi", initial={"u": spin}),
    },
    outputs={
        "energy": "total_energy()",
        "vertical": "angular_momentum(z)",
        "bearing": "mx(axle)",
    },
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    theta = mbs.simulate(system)["theta"]
    print(f"the axis leaves the level by at most {abs(theta - theta[0]).max():.1e} rad")
