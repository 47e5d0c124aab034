"""A rotor out of balance on a floor that shakes: the twin of shaken_rotor.yaml in Python."""

import multibody_sym as mbs

g, shake, w = mbs.parameters("g shake w", [9.81, "1 mm", 60])
M, m, e, J, k = mbs.parameters("M m e J k", ["8 kg", "2 kg", "0.5 mm", "0.01 kg*m^2", "20 kN/m"], positive=True)
spin, sag, c = mbs.parameters("spin sag c", [157.08, -(M + m) * g / k, 60])

system = mbs.System(
    "shaken_rotor",
    description="A rotor out of balance turns on springs above a floor that shakes.",
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(motion={"y": shake * mbs.sin(w * mbs.t)}),
        "housing": mbs.Body(mass=M),
        "rotor": mbs.Body(mass=m, com=[e, 0, 0], inertia={"Izz": J}),
    },
    joints={
        "mount": mbs.Prismatic("ground", "housing", axis="y", q="y", initial={"q": sag}),
        "axle": mbs.Revolute("housing", "rotor", axis="z", motion=spin * mbs.t),
    },
    forces={"spring": mbs.SpringDamper(joint="mount", stiffness=k, damping=c)},
    outputs={
        "height": "position(housing, y)",
        "bearing": "fy(axle)",
        "floor": "fy(mount)",
    },
    simulation={"t_end": "1 s"},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"the housing moves by {(run['height'].max() - run['height'].min()) * 1e3:.3f} mm from top to bottom")
