"""A ball bounces to rest: the twin of bouncing_ball.yaml in Python."""

import multibody_sym as mbs

g, h, m = mbs.parameters("g h m", ["9.81 m/s^2", "1 m", "0.2 kg"], positive=True)
(e,) = mbs.parameters("e", [0.6])

system = mbs.System(
    "bouncing_ball",
    description="A ball falls from a height h and bounces. When does it come to rest?",
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}),
        "ball": mbs.Body(mass=m),
    },
    joints={"fall": mbs.Prismatic("ground", "ball", axis="y", q="y", initial={"q": h})},
    contacts={"c": mbs.Contact(["ball", "ground.floor"], restitution=e)},
    simulation=mbs.Settings(t_end="2 s"),
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"at rest from t = {run.events[-1]['t']:.9f} s")
