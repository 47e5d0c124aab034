"""The potential of Henon and Heiles: the twin of henon_heiles.yaml in Python."""

import multibody_sym as mbs

E, a = mbs.parameters("E a", [0.125, 1.3])

system = mbs.System(
    "henon_heiles",
    description=(
        "A star near the middle of a galaxy moves in the potential of Henon and Heiles. At this energy its "
        "motion is chaotic."
    ),
    bodies={"star": mbs.Body(mass=1)},
    joints={
        "place": mbs.PointJoint(
            "ground",
            "star",
            q=["x", "y"],
            initial={"u": [mbs.sqrt(2 * E) * mbs.cos(a), mbs.sqrt(2 * E) * mbs.sin(a)]},
        )
    },
    forces={"galaxy": mbs.Potential("(x^2 + y^2)/2 + x^2*y - y^3/3", joint="place")},
    outputs={"energy": "total_energy()"},
    simulation={"t_end": 100, "rtol": 1e-10, "atol": 1e-11},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"the energy {run['energy'][0]:.6f} changes by {abs(run['energy'] - run['energy'][0]).max():.1e}")
