"""A bicycle that nobody rides: the twin of bicycle.yaml in Python."""

import multibody_sym as mbs

v, g, w, c = mbs.parameters("v g w c", ["5 m/s", "9.81 m/s^2", "1.02 m", "0.08 m"])
tilt, head = mbs.parameters("tilt head", ["18 deg", "0.9 m"])
rear_radius, front_radius = mbs.parameters("rear_radius front_radius", ["0.3 m", "0.35 m"])
back, up = head * mbs.sin(tilt), head * mbs.cos(tilt)  # along the steering axis from the road to the steering head


def wheel(mass: str, radius: mbs.Parameter, across: float, about: float) -> mbs.Body:
    inertia = {"Ixx": across, "Iyy": about, "Izz": across}
    return mbs.Body(mass=mass, inertia=inertia, surfaces={"rim": {"disc": radius, "axis": "y"}})


system = mbs.System(
    "bicycle",
    description=(
        "A bicycle that nobody rides: two wheels roll without slip, the rear frame leans, the front frame "
        "steers. At which speeds is it stable by itself?"
    ),
    gravity=[0, 0, -g],
    bodies={
        "ground": mbs.Body(surfaces={"road": {"plane": [0, 0, 0], "normal": "z"}}, points={"front": [w, 0, 0]}),
        "frame": mbs.Body(
            mass="85 kg",
            com=[0.3, 0, 0.9 - rear_radius],
            inertia={"Ixx": 9.2, "Iyy": 11, "Izz": 2.8, "Ixz": -2.4},
            points={"head": [w + c - back, 0, up - rear_radius]},
        ),
        "fork": mbs.Body(
            mass="4 kg",
            com=[0.9 - w - c + back, 0, 0.7 - up],
            inertia={"Ixx": 0.05892, "Iyy": 0.06, "Izz": 0.00708, "Ixz": 0.00756},
            points={"axle": [back - c, 0, front_radius - up]},
        ),
        "rear": wheel("2 kg", rear_radius, 0.0603, 0.12),
        "front": wheel("3 kg", front_radius, 0.1405, 0.28),
    },
    joints={
        "ride": mbs.Free(
            "ground",
            "frame",
            angles="zxy",
            q=["x", "y", "z", "yaw", "lean", "pitch"],
            initial={"q": [0, 0, rear_radius, 0, 0, 0], "u": [v, 0, 0, 0, 0, 0]},
        ),
        "steer": mbs.Revolute("frame.head", "fork", axis=[-mbs.sin(tilt), 0, mbs.cos(tilt)], q="steer"),
        "rear_wheel": mbs.Revolute("frame", "rear", axis="y", q="rear_angle", initial={"u": v / rear_radius}),
        "front_wheel": mbs.Revolute("fork.axle", "front", axis="y", q="front_angle", initial={"u": v / front_radius}),
    },
    constraints={
        "rear_contact": mbs.Rolling("rear.rim", "ground.road"),
        "front_contact": mbs.Rolling("front.rim", "ground.road"),
    },
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    for value in mbs.linearize(system).eigenvalues:
        print(f"{value:.9g}")
