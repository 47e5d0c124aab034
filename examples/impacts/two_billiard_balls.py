"""A billiard ball meets another: the twin of two_billiard_balls.yaml in Python."""

import multibody_sym as mbs

g, r, m, v = mbs.parameters("g r m v", ["9.81 m/s^2", "0.03 m", "0.2 kg", "2 m/s"], positive=True)
(k,) = mbs.parameters("k", [1])
mu, f, e = mbs.parameters("mu f e", [0.2, 0.05, 0.9], positive=True)


def ball() -> mbs.Body:
    return mbs.Body(shape={"sphere": r, "mass": m}, surfaces={"skin": mbs.Surface(sphere=r)})


cue = {"q": [0, r, 0], "u": [v, 0, -k * v / r]}
system = mbs.System(
    "two_billiard_balls",
    description="A billiard ball that rolls meets another of equal mass head on. How do both roll at last?",
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(surfaces={"cloth": mbs.Surface(plane=[0, 0, 0], normal="y")}),
        "cue": ball(),
        "object": ball(),
    },
    joints={
        "A": mbs.Planar("ground", "cue", q=["x1", "y1", "phi1"], initial=cue),
        "B": mbs.Planar("ground", "object", q=["x2", "y2", "phi2"], initial={"q": [2 * r, r, 0], "u": [0, 0, 0]}),
    },
    contacts={
        "cloth1": mbs.Contact(["cue.skin", "ground.cloth"], kinetic=mu),
        "cloth2": mbs.Contact(["object.skin", "ground.cloth"], kinetic=mu),
        "balls": mbs.Contact(["object.skin", "cue.skin"], kinetic=f, restitution=e),
    },
    impact="closing",
    simulation=mbs.Settings(t_end="1 s"),
)

if __name__ == "__main__":
    speeds = mbs.simulate(system).final["speeds"]
    print(f"they roll with u_x1 = {speeds['u_x1']:.9f} m/s and u_x2 = {speeds['u_x2']:.9f} m/s")
