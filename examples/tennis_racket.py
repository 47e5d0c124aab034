"""A racket spinning about its middle axis: the twin of tennis_racket.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, A, B, C = mbs.parameters(
    "m A B C", ["0.33 kg", "0.0012 kg*m^2", "0.0164 kg*m^2", "0.0175 kg*m^2"], positive=True
)
toss, spin, wobble = mbs.parameters("toss spin wobble", ["10 m/s", 15, 0.05])

system = mbs.System(
    "tennis_racket",
    description=(
        "A racket is tossed up spinning about its middle axis. Again and again it turns over: the tennis "
        "racket theorem."
    ),
    gravity=[0, 0, -g],
    bodies={
        "racket": mbs.Body(
            mass=m,
            inertia={"Ixx": A, "Iyy": B, "Izz": C},
            surfaces={
                "head": {"disc": "13 cm", "centre": ["20 cm", 0, 0], "inside": True},
                "handle": {"segment": [["7 cm", 0, 0], ["-32 cm", 0, 0]]},
            },
        )
    },
    joints={"flight": mbs.Free("ground", "racket", initial={"u": [0, 0, toss, 0, spin, wobble]})},
    outputs={
        "energy": "total_energy()",
        "height": "position(racket, z)",
        "axis": "angular_velocity(racket, y)",
    },
    simulation={"t_end": "2 s"},
)

if __name__ == "__main__":
    rate = mbs.simulate(system)["flight_wy"]
    turns = ((rate[1:] > 0) != (rate[:-1] > 0)).sum()
    print(f"the racket turns over {turns} times in 2 s")
