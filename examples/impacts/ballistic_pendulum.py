"""A bullet sticks in a pendulum: the twin of ballistic_pendulum.yaml in Python."""

import multibody_sym as mbs

g, m, v, M, l, J = mbs.parameters(
    "g m v M l J", ["9.81 m/s^2", "0.01 kg", "400 m/s", "1 kg", "1 m", "0.33 kg*m^2"], positive=True
)

system = mbs.System(
    "ballistic_pendulum",
    description=(
        "A bullet sticks in a pendulum that hangs at rest. How fast does it swing off, what does the axle "
        "feel, what is lost?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(points={"muzzle": [0, -l, 0]}),
        "bullet": mbs.Body(mass=m),
        "pendulum": mbs.Body(mass=M, com=[0, -l, 0], inertia={"Izz": J}, points={"middle": [0, -l, 0]}),
    },
    joints={
        "flight": mbs.PointJoint("ground.muzzle", "bullet", q=["x", "y"], initial={"u": [v, 0]}),
        "axle": mbs.Revolute("ground", "pendulum", axis="z", q="phi", initial={"q": 0, "u": 0}),
        "stuck": mbs.Spherical("pendulum.middle", "bullet", cut=True),
    },
    impact=mbs.Impact(begins="stuck"),
    simulation=mbs.Settings(t_end="0.4 s"),
)

if __name__ == "__main__":
    after = mbs.solve(system).impact.after
    print(f"omega = {after['u_phi']}")
