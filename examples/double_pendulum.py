"""A double pendulum of two point masses: the twin of double_pendulum.yaml in Python."""

import multibody_sym as mbs

system = mbs.System(
    "double_pendulum",
    description="A double pendulum of two point masses, released from rest with both rods horizontal.",
    gravity=[0, "-g", 0],
    parameters={
        "m1": {"value": "1 kg", "positive": True},
        "m2": {"value": "1 kg", "positive": True},
        "l1": {"value": "1 m", "positive": True},
        "l2": {"value": "1 m", "positive": True},
        "g": 9.81,
    },
    bodies={
        "upper": mbs.Body(mass="m1", com=[0, "-l1", 0], points={"end": [0, "-l1", 0]}),
        "lower": mbs.Body(mass="m2", com=[0, "-l2", 0]),
    },
    joints={
        "shoulder": mbs.Revolute("ground", "upper", axis="z", q="theta1", initial={"q": "90 deg"}),
        "elbow": mbs.Revolute("upper.end", "lower", axis="z", q="theta2"),
    },
    outputs={"energy": "total_energy()"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"theta1 = {run['theta1'][-1]:.6f}, theta2 = {run['theta2'][-1]:.6f} after {run.t[-1]:g} s")
