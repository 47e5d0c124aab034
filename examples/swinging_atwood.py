"""A pendulum hung from a rope over two pulleys: the twin of swinging_atwood.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
M, m, r0 = mbs.parameters("M m r0", ["3 kg", "1 kg", "1 m"], positive=True)
(start,) = mbs.parameters("start", ["90 deg"])

system = mbs.System(
    "swinging_atwood",
    description=(
        "Atwood's machine of which one load swings: a pendulum hangs from a rope over two pulleys, and a load"
        " balances it."
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"left": [-1, 0, 0], "right": [0, 0, 0]}),
        "line": mbs.Body(),
        "bob": mbs.Body(mass=m),
        "load": mbs.Body(mass=M),
    },
    joints={
        "turn": mbs.Revolute("ground.right", "line", axis="z", q="theta", initial={"q": start}),
        "along": mbs.Prismatic("line", "bob", axis="-y", q="r", initial={"q": r0}),
        "shaft": mbs.Prismatic("ground.left", "load", axis="-y", q="s", initial={"q": "2 m"}),
    },
    pulleys={"P1": mbs.Pulley("ground.left"), "P2": mbs.Pulley("ground.right")},
    constraints={"rope": mbs.Rope(["load", "P1", "P2", "bob"])},
    outputs={
        "pull": "tension(rope)",
        "energy": "total_energy()",
        "second": "r^2*u_theta*(u_r*cos(theta/2) - r*u_theta*sin(theta/2)/2) + g*r^2*sin(theta/2)*cos(theta/2)^2",
    },
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"the rope pulls with {run['pull'].min():.3f} to {run['pull'].max():.3f} N")
