"""A pendulum: the twin of pendulum.yaml in Python. Text is welcome wherever the file takes an expression."""

import multibody_sym as mbs

system = mbs.System(
    "pendulum",
    description="A pendulum: one hinge, one bob. The place to start.",
    gravity=[0, "-g", 0],
    parameters={
        "m": {"value": "1 kg", "positive": True},
        "l": {"value": "1 m", "positive": True},
        "g": 9.81,
    },
    bodies={"bob": mbs.Body(mass="m", com=[0, "-l", 0])},
    joints={"hinge": mbs.Revolute("ground", "bob", axis="z", q="theta", initial={"q": "60 deg", "u": 0})},
    outputs={"height": "position(bob, y)", "energy": "total_energy()", "pull": "fy(hinge)"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    print("theta'' =", mbs.solve(system).accelerations["theta"])
