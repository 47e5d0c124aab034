"""A cart on two wheels that roll without slip: the twin of two_wheeled_cart.yaml in Python."""

import multibody_sym as mbs

m, J, mw, b = mbs.parameters("m J mw b", ["5 kg", "0.2 kg*m^2", "0.5 kg", "0.25 m"])
(r,) = mbs.parameters("r", ["0.1 m"], positive=True)
across, about = mw * r**2 / 4, mw * r**2 / 2
wheel = mbs.Body(
    mass=mw, inertia={"Ixx": across, "Iyy": about, "Izz": across}, surfaces={"rim": {"disc": r, "axis": "y"}}
)

system = mbs.System(
    "two_wheeled_cart",
    description="A cart on two wheels that roll without slip is driven by unequal torques. It drives curves.",
    gravity=[0, 0, -9.81],
    bodies={
        "ground": mbs.Body(surfaces={"floor": {"plane": [0, 0, 0], "normal": "z"}}, points={"axle": [0, 0, r]}),
        "cart": mbs.Body(
            mass=m,
            com=[0.05, 0, 0],
            inertia={"Ixx": 0.1, "Iyy": 0.1, "Izz": J},
            points={"left": [0, b, 0], "right": [0, -b, 0]},
        ),
        "left": wheel,
        "right": wheel,
    },
    joints={
        "ride": mbs.Planar("ground.axle", "cart", q=["x", "y", "theta"]),
        "left_wheel": mbs.Revolute("cart.left", "left", axis="y", q="phi_left"),
        "right_wheel": mbs.Revolute("cart.right", "right", axis="y", q="phi_right"),
    },
    constraints={
        "left_contact": mbs.Rolling("left.rim", "ground.floor"),
        "right_contact": mbs.Rolling("right.rim", "ground.floor"),
    },
    forces={
        "drive_left": mbs.Torque(0.1, joint="left_wheel"),
        "drive_right": mbs.Torque(0.1 * (1 + 0.5 * mbs.sin(mbs.t)), joint="right_wheel"),
    },
    outputs={"speed": "velocity(cart, x)"},
    simulation={"t_end": "10 s"},
)

if __name__ == "__main__":
    print("redundant:", mbs.check(system).redundant)
