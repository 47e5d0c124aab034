"""A robot that lands on four feet: the twin of robot_on_feet.yaml in Python."""

import multibody_sym as mbs

g, M, m1, m2, l, mu, k, c, drop = mbs.parameters(
    "g M m1 m2 l mu k c drop",
    ["9.81 m/s^2", "2 kg", "0.7 kg", "0.3 kg", "0.2 m", 0.7, "60 N*m/rad", "3 N*m*s/rad", "0.05 m"],
    positive=True,
)
(bend,) = mbs.parameters("bend", ["0.6 rad"])
LEGS = {"lf": (1, 1), "rf": (1, -1), "lh": (-1, 1), "rh": (-1, -1)}
"""Left and right, front and hind: to which side of the trunk along x and y."""


def link(mass: object, end: str) -> mbs.Body:
    """Return a thin rod of the length l that hangs from its origin."""
    across = mass * l**2 / 12
    inertia = {"Ixx": across, "Iyy": across, "Izz": mass * l**2 / 120}
    return mbs.Body(mass=mass, com=[0, 0, -l / 2], inertia=inertia, points={end: [0, 0, -l]})


trunk = mbs.Body(
    shape={"box": ["0.5 m", "0.2 m", "0.1 m"], "mass": 4 * M},
    points={leg: [f"{0.2 * x} m", f"{0.1 * y} m", 0] for leg, (x, y) in LEGS.items()},
)
bodies = {"ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="z")}), "trunk": trunk}
start = [0, 0, 2 * l * mbs.cos(bend) + drop, 1, 0, 0, 0]
joints = {"float": mbs.Free("ground", "trunk", q=["x", "y", "z", "e0", "e1", "e2", "e3"], initial={"q": start})}
forces, contacts = {}, {}
for leg, (x, _) in LEGS.items():
    hip, knee, thigh, shank = f"hip_{leg}", f"knee_{leg}", f"thigh_{leg}", f"shank_{leg}"
    roll, pitch = f"roll_{leg}", f"pitch_{leg}"
    bodies |= {thigh: link(m1, "knee"), shank: link(m2, "foot")}
    joints |= {
        hip: mbs.Universal(f"trunk.{leg}", thigh, axes=["x", "y"], q=[roll, pitch], initial={"q": [0, x * bend]}),
        knee: mbs.Revolute(f"{thigh}.knee", shank, axis="y", q=knee, initial={"q": -2 * x * bend}),
    }
    forces |= {
        roll: mbs.SpringDamper(joint=hip, freedom=roll, stiffness=k, damping=c),
        pitch: mbs.SpringDamper(joint=hip, freedom=pitch, stiffness=k, damping=c, length=x * bend),
        f"bend_{leg}": mbs.SpringDamper(joint=knee, stiffness=k, damping=c, length=-2 * x * bend),
    }
    contacts[f"foot_{leg}"] = mbs.Contact([f"{shank}.foot", "ground.floor"], static=mu)

system = mbs.System(
    "robot_on_feet",
    description=(
        "A robot with four legs, whose drives hold their angles as springs with dampers do, is dropped and lands on "
        "its feet. How high does it stand at last, and what does each foot carry?"
    ),
    gravity=[0, 0, -g],
    bodies=bodies,
    joints=joints,
    forces=forces,
    contacts=contacts,
    outputs={f"carried_{leg}": f"normal(foot_{leg})" for leg in LEGS},
    simulation=mbs.Settings(t_end="2 s"),
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"height = {run['z'][-1]:.6f} m, carried = {sum(run[f'carried_{leg}'][-1] for leg in LEGS):.4f} N")
