"""A rope goes taut under a falling load: the twin of falling_load.yaml in Python."""

import multibody_sym as mbs

g, H, h, m, M = mbs.parameters("g H h m M", ["10 m/s^2", "2 m", "0.8 m", "1 kg", "3 kg"], positive=True)

system = mbs.System(
    "falling_load",
    description=(
        "A load falls freely through h before its rope, over two pulleys, goes taut and jerks a heavier load "
        "from the ground. How fast do they move then, and how strong is the jerk?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(
            points={"left": [0, H, 0], "right": [H / 2, H, 0], "foot": [H / 2, 0, 0]},
            surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")},
        ),
        "load": mbs.Body(mass=m),
        "heavy": mbs.Body(mass=M),
    },
    pulleys={"P1": mbs.Pulley("ground.left"), "P2": mbs.Pulley("ground.right")},
    constraints={"rope": mbs.Rope(["load", "P1", "P2", "heavy"], slack=True, length=2 * H + h)},
    joints={
        "A": mbs.Prismatic("ground", "load", axis="y", q="y1", initial={"q": H / 2}),
        "B": mbs.Prismatic("ground.foot", "heavy", axis="y", q="y2"),
    },
    contacts={"stand": mbs.Contact(["heavy", "ground.floor"])},
    simulation=mbs.Settings(t_end="0.5 s"),
)

if __name__ == "__main__":
    for event in mbs.simulate(system).events:
        print(f"t = {event['t']:.9f} s: {event['element']} {event['kind']}")
