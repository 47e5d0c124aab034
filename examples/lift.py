"""A person on a scale in a lift: the twin of lift.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
h, T, m = mbs.parameters("h T m", ["12 m", "8 s", "70 kg"], positive=True)
t, pi = mbs.t, mbs.pi

system = mbs.System(
    "lift",
    description="A person stands on a scale in a lift that starts and stops smoothly. What does the scale show?",
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(
            motion={"y": h * (t / T - mbs.sin(2 * pi * t / T) / (2 * pi))},
            surfaces={
                "left": {"segment": [["-1 m", "2 m", 0], ["-1 m", 0, 0]]},
                "floor": {"segment": [["-1 m", 0, 0], ["1 m", 0, 0]]},
                "roof": {"segment": [["1 m", "2 m", 0], ["-1 m", "2 m", 0]]},
                "right": {"segment": [["1 m", 0, 0], ["1 m", "2 m", 0]]},
            },
        ),
        "person": mbs.Body(mass=m),
    },
    joints={"scale": mbs.Fixed("ground", "person")},
    outputs={"reading": "fy(scale)", "kilograms": "fy(scale)/g", "speed": "velocity(person, y)"},
    simulation={"t_end": T},
)

if __name__ == "__main__":
    kilograms = mbs.simulate(system)["kilograms"]
    print(f"the scale shows {kilograms.min():.2f} to {kilograms.max():.2f} kg")
