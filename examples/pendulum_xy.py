"""A pendulum in x and y with a rod as constraint: the twin of pendulum_xy.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, l = mbs.parameters("m l", ["1 kg", "1 m"], positive=True)
(start,) = mbs.parameters("start", ["60 deg"])

system = mbs.System(
    "pendulum_xy",
    description=(
        "A pendulum in x and y: a free particle and a rod that keeps its distance. The rod's multiplier is "
        "its tension."
    ),
    gravity=[0, -g, 0],
    bodies={"rider": mbs.Body(), "bob": mbs.Body(mass=m)},
    joints={
        "along": mbs.Prismatic("ground", "rider", axis="x", q="x", initial={"q": l * mbs.sin(start)}),
        "up": mbs.Prismatic("rider", "bob", axis="y", q="y", initial={"q": -l * mbs.cos(start)}),
    },
    constraints={"rod": mbs.Distance(["ground", "bob"], l)},
    outputs={"energy": "total_energy()", "pull": "tension(rod)"},
    simulation={"t_end": "10 s", "constraints": {"projection": True}},
)

if __name__ == "__main__":
    print("tension of the rod =", mbs.solve(system).reactions["rod"]["tension"])
