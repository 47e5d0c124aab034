"""A spherical pendulum thrown sideways: the twin of spherical_pendulum.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
m, l = mbs.parameters("m l", ["1 kg", "1 m"], positive=True)
tilt, rate = mbs.parameters("tilt rate", ["60 deg", 3])

system = mbs.System(
    "spherical_pendulum",
    description="A spherical pendulum is thrown sideways: the bob goes round, and up and down between two heights.",
    gravity=[0, 0, -g],
    bodies={"bob": mbs.Body(mass=m, com=[0, 0, -l])},
    joints={
        "string": mbs.Custom(
            "ground",
            "bob",
            free=[mbs.Direct(rotate="z"), mbs.Direct(rotate="y")],
            q=["phi", "theta"],
            initial={"q": [0, tilt], "u": [rate, 0]},
        )
    },
    outputs={"height": "position(bob, z)", "vertical": "angular_momentum(z)", "energy": "total_energy()"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    heights = mbs.simulate(system)["height"]
    print(f"the bob moves between z = {heights.min():.6f} m and z = {heights.max():.6f} m")
