"""Two chains of two rods strike with their ends: the twin of two_chains.yaml in Python."""

import multibody_sym as mbs

m1, m2, l, v, e = mbs.parameters("m1 m2 l v e", ["4 kg", "10 kg", "1 m", "1.96 m/s", 0.5], positive=True)


def rod(mass: mbs.Parameter, length: mbs.Expression, **points: list[mbs.Expression | float]) -> mbs.Body:
    return mbs.Body(mass=mass, com=[length / 2, 0, 0], inertia={"Izz": mass * l**2 / 12}, points=points)


system = mbs.System(
    "two_chains",
    description=(
        "A stretched chain of two hinged rods falls with its end on the end of another one. Which impulse "
        "acts between them and in the hinges?"
    ),
    gravity=[0, 0, 0],
    bodies={
        "a1": rod(m1, -l, tip=[0, 0, 0], end=[-l, 0, 0]),
        "a2": rod(m1, -l),
        "b1": rod(m2, l, tip=[0, 0, 0], end=[l, 0, 0]),
        "b2": rod(m2, l),
    },
    joints={
        "A": mbs.Planar("ground", "a1", q=["xa", "ya", "phia"], initial={"u": [0, -v, 0]}),
        "A2": mbs.Revolute("a1.end", "a2", axis="z", q="alpha"),
        "B": mbs.Planar("ground", "b1", q=["xb", "yb", "phib"]),
        "B2": mbs.Revolute("b1.end", "b2", axis="z", q="beta"),
    },
    impact=mbs.Impact(between=["a1.tip", "b1.tip"], normal="y", restitution=e),
)

if __name__ == "__main__":
    print(f"p = {mbs.solve(system).impact.impulses['impact']['normal']}")
