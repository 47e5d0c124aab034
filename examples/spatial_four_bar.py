"""Bennett's linkage: the twin of spatial_four_bar.yaml in Python."""

import multibody_sym as mbs

a, b, alpha = mbs.parameters("a b alpha", ["0.5 m", "0.3 m", "60 deg"])
beta, g, k = mbs.parameters("beta g k", [mbs.asin(b * mbs.sin(alpha) / a), "9.81 m/s^2", "20 N*m"])


def turned(angle: mbs.Parameter) -> list[dict[str, object]]:
    return [{"axis": "x", "angle": angle}]


def link(mass: int, length: mbs.Parameter, twist: mbs.Parameter, along: float, across: float) -> mbs.Body:
    return mbs.Body(
        mass=f"{mass} kg",
        com=[length / 2, 0, 0],
        inertia={"Ixx": along, "Iyy": across, "Izz": across},
        frames={"end": {"position": [length, 0, 0], "rotate": turned(twist)}},
    )


system = mbs.System(
    "spatial_four_bar",
    description=(
        "Bennett's linkage: a loop of four hinges in space whose axes are neither parallel nor meet, and yet "
        "it moves."
    ),
    gravity=[0, 0, -g],
    bodies={
        "ground": mbs.Body(frames={"far": {"position": [-a, 0, 0], "rotate": turned(-alpha)}}),
        "link1": link(1, b, beta, 0.001, 0.01),
        "link2": link(2, a, alpha, 0.002, 0.03),
        "link3": link(1, b, beta, 0.001, 0.01),
    },
    joints={
        "A": mbs.Revolute("ground", "link1", axis="z", q="theta1", initial={"q": "60 deg", "u": 2, "known": True}),
        "B": mbs.Revolute("link1.end", "link2", axis="z", q="theta2", initial={"q": "157.4 deg"}),
        "C": mbs.Revolute("link2.end", "link3", axis="z", q="theta3", initial={"q": "-60 deg"}),
        "D": mbs.Revolute("ground.far", "link3.end", axis="z", cut=True),
    },
    forces={"spring": mbs.SpringDamper(joint="A", stiffness=k, length="60 deg")},
    outputs={"height": "position(link2, z)"},
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    print("redundant:", mbs.check(system).redundant)
