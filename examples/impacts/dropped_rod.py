"""A rod falls on the edge of a table: the twin of dropped_rod.yaml in Python."""

import multibody_sym as mbs

g, m, l, s, v, e = mbs.parameters("g m l s v e", ["9.81 m/s^2", "2 kg", "1.2 m", "0.2 m", "3 m/s", 0.5], positive=True)
below = mbs.Surface(segment=[[-l / 2, 0, 0], [l / 2, 0, 0]], normal="-y")

system = mbs.System(
    "dropped_rod",
    description=(
        "A level rod falls on the edge of a table, at a distance s from its middle. What is the impulse, and "
        "how does the rod turn away?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"edge": [s, 0, 0]}),
        "rod": mbs.Body(mass=m, inertia={"Izz": m * l**2 / 12}, surfaces={"below": below}),
    },
    joints={"fall": mbs.Planar("ground", "rod", q=["x", "y", "phi"], initial={"u": [0, -v, 0]})},
    contacts={"hit": mbs.Contact(["ground.edge", "rod.below"], restitution=e)},
    impact="closing",
    simulation=mbs.Settings(t_end="0.5 s"),
)

if __name__ == "__main__":
    print(f"p = {mbs.solve(system).impact.impulses['hit']['normal']}")
