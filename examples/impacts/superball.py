"""An elastic ball that grips the floor: the twin of superball.yaml in Python."""

import multibody_sym as mbs

m, r, u, v, w = mbs.parameters("m r u v w", ["0.1 kg", "0.025 m", "2 m/s", "3 m/s", "200 rad/s"], positive=True)

system = mbs.System(
    "superball",
    description="A superball meets the floor with a velocity along it and a spin. How does it leave?",
    gravity=[0, 0, 0],
    bodies={
        "ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}),
        "ball": mbs.Body(shape={"sphere": r, "mass": m}, surfaces={"skin": mbs.Surface(sphere=r)}),
    },
    joints={
        "free": mbs.Planar("ground", "ball", q=["x", "y", "phi"], initial={"q": [0, r, 0], "u": [u, -v, w]}),
    },
    contacts={"c": mbs.Contact(["ball.skin", "ground.floor"], static=1, restitution=1)},
    impact=mbs.Impact(contacts="c", tangential_restitution=1),
)

if __name__ == "__main__":
    for speed, after in mbs.solve(system).impact.after.items():
        print(f"{speed} = {after}")
