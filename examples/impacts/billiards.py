"""A ball struck by a cue: the twin of billiards.yaml in Python."""

import multibody_sym as mbs

g, m, r, c, mu, I = mbs.parameters(
    "g m r c mu I", ["9.81 m/s^2", "0.2 kg", "0.03 m", "0.018 m", 0.2, "0.4 N*s"], positive=True
)

system = mbs.System(
    "billiards",
    description=(
        "A billiard ball is struck horizontally at a height c above its centre. How does it move off, and how"
        " does it roll at last?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(surfaces={"cloth": mbs.Surface(plane=[0, 0, 0], normal="y")}),
        "ball": mbs.Body(
            shape={"sphere": r, "mass": m}, points={"cue": [0, c, 0]}, surfaces={"skin": mbs.Surface(sphere=r)}
        ),
    },
    joints={"free": mbs.Planar("ground", "ball", q=["x", "y", "phi"], initial={"q": [0, r, 0]})},
    contacts={"table": mbs.Contact(["ball.skin", "ground.cloth"], kinetic=mu)},
    impact=mbs.Impact(impulse=[I, 0, 0], at="ball.cue"),
    simulation=mbs.Settings(t_end="1 s"),
)

if __name__ == "__main__":
    rolls = mbs.simulate(system).events[-1]
    print(f"rolls from t = {rolls['t']:.9f} s")
