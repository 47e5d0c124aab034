"""A parallelogram linkage struck at its coupler: the twin of struck_four_bar.yaml in Python."""

import multibody_sym as mbs

m, M, a, b, s, I, D = mbs.parameters(
    "m M a b s I D", ["2 kg", "2 kg", "0.3 m", "0.8 m", "0.2 m", "1 N*s", "2 N*s"], positive=True
)


def crank() -> mbs.Body:
    return mbs.Body(mass=m, com=[0, a / 2, 0], inertia={"Izz": m * a**2 / 12}, points={"top": [0, a, 0]})


system = mbs.System(
    "struck_four_bar",
    description=(
        "The coupler of a parallelogram linkage is struck obliquely while its cranks stand upright. How fast "
        "do they turn, and which impulses go through the four hinges?"
    ),
    gravity=[0, 0, 0],
    bodies={
        "ground": mbs.Body(points={"pivot": [b, 0, 0]}),
        "left": crank(),
        "right": crank(),
        "coupler": mbs.Body(
            mass=M, com=[b / 2, 0, 0], inertia={"Izz": M * b**2 / 12}, points={"hit": [s, 0, 0], "end": [b, 0, 0]}
        ),
    },
    joints={
        "A": mbs.Revolute("ground", "left", axis="z", q="phi", initial={"q": 0, "u": 0, "known": True}),
        "B": mbs.Revolute("left.top", "coupler", axis="z", q="beta"),
        "D0": mbs.Revolute("ground.pivot", "right", axis="z", q="psi"),
        "C": mbs.Revolute("coupler.end", "right.top", axis="z", cut=True),
    },
    impact=mbs.Impact(impulse=[I, -D, 0], at="coupler.hit"),
)

if __name__ == "__main__":
    print(f"omega = {mbs.solve(system).impact.after['u_phi']}")
