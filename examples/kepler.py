"""Kepler's problem in years and astronomical units: the twin of kepler.yaml in Python."""

import multibody_sym as mbs

(m,) = mbs.parameters("m", [0.001], positive=True)
e, GM = mbs.parameters("e GM", [0.3, "4*pi^2"])

system = mbs.System(
    "kepler",
    description=(
        "Kepler's problem: a planet on an ellipse about the sun, in years and astronomical units, so that the"
        " sun's G M is 4 pi^2."
    ),
    bodies={"planet": mbs.Body(mass=m)},
    joints={
        "orbit": mbs.Custom(
            "ground",
            "planet",
            free=[mbs.Direct(rotate="z"), mbs.Direct(translate="x")],
            q=["phi", "r"],
            initial={"q": [0, 1 - e], "u": [mbs.sqrt(GM * (1 + e) / (1 - e)) / (1 - e), 0]},
        )
    },
    forces={"sun": mbs.Gravitation(["ground", "planet"], constant=GM, masses=[1, m])},
    outputs={"energy": "total_energy()", "spin": "angular_momentum(z)"},
    simulation={"t_end": 1, "rtol": 1e-11, "atol": 1e-12},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"farthest from the sun: {run['r'].max():.6f}, where the ellipse ends at 1.3")
