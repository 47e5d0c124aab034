"""A Stewart platform: the twin of stewart_platform.yaml in Python."""

import multibody_sym as mbs

g, R, b, r, c = mbs.parameters("g R b r c", ["9.81 m/s^2", "0.5 m", "10 deg", "0.3 m", "50 deg"])
M, lower, upper, s, J = mbs.parameters("M lower upper s J", ["40 kg", "2 kg", "1 kg", "0.2 m", "0.02 kg*m^2"])
k, d, l0 = mbs.parameters("k d l0", ["20000 N/m", "600 N*s/m", "0.72 m"])
LEGS = range(1, 7)
GUESSES = [(13, -26), (-13, -26), (17, 24), (29, 2), (-29, 2), (-17, 24)]


def circle(radius: mbs.Parameter, half: mbs.Parameter, letter: str) -> dict[str, list[object]]:
    third = 2 * mbs.pi / 3
    angles = [-half, half, third - half, third + half, 2 * third - half, 2 * third + half]
    return {f"{letter}{k}": [radius * mbs.cos(x), radius * mbs.sin(x), 0] for k, x in enumerate(angles, 1)}


def half(mass: mbs.Parameter, height: object, inertia: object) -> mbs.Body:
    return mbs.Body(mass=mass, com=[0, 0, height], inertia={"Ixx": inertia, "Iyy": inertia, "Izz": inertia / 100})


def leg(n: int) -> dict[str, mbs.Body]:
    return {f"lower{n}": half(lower, s, J), f"upper{n}": half(upper, -s, J / 2)}


system = mbs.System(
    "stewart_platform",
    description=(
        "A Stewart platform: a plate on six legs, each of two bodies, with a spring and a damper in each "
        "slider."
    ),
    gravity=[0, 0, -g],
    bodies={
        "ground": mbs.Body(points=circle(R, b, "b")),
        "plate": mbs.Body(
            mass=M,
            inertia={"Ixx": M * r**2 / 4, "Iyy": M * r**2 / 4, "Izz": M * r**2 / 2},
            points=circle(r, c, "p"),
        ),
        **{name: body for n in LEGS for name, body in leg(n).items()},
    },
    joints={
        **{
            f"base{n}": mbs.Universal(
                f"ground.b{n}", f"lower{n}", axes=["x", "y"], initial={"q": [f"{x} deg", f"{y} deg"]}
            )
            for n, (x, y) in enumerate(GUESSES, 1)
        },
        **{
            f"leg{n}": mbs.Prismatic(
                f"lower{n}", f"upper{n}", axis="z", q=f"l{n}", initial={"q": l0, "known": True}
            )
            for n in LEGS
        },
        **{f"ball{n}": mbs.Spherical(f"upper{n}", f"plate.p{n}") for n in LEGS},
    },
    forces={f"drive{n}": mbs.SpringDamper(joint=f"leg{n}", stiffness=k, damping=d, length=l0) for n in LEGS},
    outputs={"height": "position(plate, z)", "carried": " + ".join(f"fz(base{n})" for n in LEGS)},
    simulation={"t_end": "2 s"},
)

if __name__ == "__main__":
    print(mbs.simulate(system)["carried"][-1], "N are carried")
