"""A rod topples on a rough floor: the twin of toppling_rod.yaml in Python."""

import multibody_sym as mbs

g, m, l, mu = mbs.parameters("g m l mu", ["9.81 m/s^2", "1 kg", "1 m", 0.3], positive=True)
(phi0,) = mbs.parameters("phi0", ["1 deg"])

system = mbs.System(
    "toppling_rod",
    description=(
        "A rod that stands nearly upright on a rough floor topples to the left. At which angle does its foot slip, and "
        "which way?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}),
        "rod": mbs.Body(
            mass=m,
            inertia={"Izz": m * l**2 / 12},
            points={"bottom": [0, -l / 2, 0], "top": [0, l / 2, 0]},
            surfaces={"bar": mbs.Surface(segment=["bottom", "top"])},
        ),
    },
    joints={
        "free": mbs.Planar(
            "ground",
            "rod",
            q=["x", "y", "phi"],
            initial={"q": [-l / 2 * mbs.sin(phi0), l / 2 * mbs.cos(phi0), phi0]},
        )
    },
    contacts={
        "foot": mbs.Contact(["rod.bottom", "ground.floor"], static=mu),
        "head": mbs.Contact(["rod.top", "ground.floor"], static=mu),
    },
    ask={"slips_at": {"value": "phi", "when": "foot slides"}},
    simulation=mbs.Settings(t_end="2 s"),
)

if __name__ == "__main__":
    print(f"slips at phi = {mbs.solve(system).answers['slips_at'].value:.9f} rad")
