"""A bob on a spring that also swings: the twin of elastic_pendulum.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, r0, k, l = mbs.parameters("m r0 k l", ["0.5 kg", "1.2 m", "40 N/m", "1 m"], positive=True)

system = mbs.System(
    "elastic_pendulum",
    description="A bob on a spring that also swings: a hinge carries a slider, and a spring acts in the slider.",
    gravity=[0, -g, 0],
    bodies={"arm": mbs.Body(), "bob": mbs.Body(mass=m)},
    joints={
        "hinge": mbs.Revolute("ground", "arm", axis="z", q="theta", initial={"q": "40 deg"}),
        "slider": mbs.Prismatic("arm", "bob", axis="-y", q="r", initial={"q": r0}),
    },
    forces={"spring": mbs.SpringDamper(joint="slider", stiffness=k, length=l)},
    outputs={"energy": "total_energy()"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    for name, value in mbs.solve(system).accelerations.items():
        print(f"{name}'' = {value}")
