"""A crank-slider with a stiff spring in its rod: the twin of elastic_rod.yaml in Python."""

import multibody_sym as mbs

r, l = mbs.parameters("r l", ["0.1 m", "0.3 m"], positive=True)
m1, m2, m3 = mbs.parameters("m1 m2 m3", ["1 kg", "100 g", "3 g"])
(k,) = mbs.parameters("k", ["1e8 N/m"], positive=True)
c, g = mbs.parameters("c g", ["100 N*s/m", "9.81 m/s^2"])


def bar(mass: mbs.Parameter, length: mbs.Parameter, end: str) -> mbs.Body:
    inertia = {"Izz": mass * length**2 / 12}
    return mbs.Body(mass=mass, com=[length / 2, 0, 0], inertia=inertia, points={end: [length, 0, 0]})


system = mbs.System(
    "elastic_rod",
    description="A crank-slider whose rod gives a little: a spring of 1e8 N/m in it, against a reduced mass of 10 g.",
    gravity=[0, -g, 0],
    bodies={
        "crank": bar(m1, r, "pin"),
        "rod": bar(m2, l, "end"),
        "tip": mbs.Body(mass=m3),
        "slider": mbs.Body(mass=m3),
    },
    joints={
        "A": mbs.Revolute("ground", "crank", axis="z", q="phi", initial={"q": "-60 deg", "known": True}),
        "B": mbs.Revolute("crank.pin", "rod", axis="z", q="psi", initial={"q": "75 deg"}),
        "E": mbs.Prismatic("rod.end", "tip", axis="x", q="stretch", initial={"q": 0, "known": True}),
        "D": mbs.Prismatic("ground", "slider", axis="x", q="s", initial={"q": 0.3}),
        "C": mbs.Revolute("tip", "slider", axis="z", cut=True),
    },
    forces={"elasticity": mbs.SpringDamper(joint="E", stiffness=k, damping=c)},
    outputs={"push": "fx(C)"},
    simulation={"t_end": "2 s", "method": "radau_5", "rtol": 1e-5, "atol": 1e-5, "constraints": {"index_2": True}},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"{run.statistics['steps']} steps, stretched by at most {abs(run['stretch']).max():.2g} m")
