"""A ball meets a racket that is swung: the twin of moving_racket.yaml in Python."""

import multibody_sym as mbs

m, M, v, A, W, e = mbs.parameters(
    "m M v A W e", ["0.058 kg", "0.3 kg", "10 m/s", "0.4 m", "20 rad/s", 0.8], positive=True
)

system = mbs.System(
    "moving_racket",
    description=(
        "A ball meets a racket that is swung by a prescribed motion. How fast does it leave, and what does "
        "the hand feel?"
    ),
    gravity=[0, 0, 0],
    bodies={
        "racket": mbs.Body(mass=M, surfaces={"strings": mbs.Surface(plane=[0, 0, 0], normal="x")}),
        "ball": mbs.Body(mass=m),
    },
    joints={
        "hand": mbs.Prismatic("ground", "racket", axis="x", motion=A * mbs.sin(W * mbs.t)),
        "flight": mbs.Prismatic("ground", "ball", axis="x", q="x", initial={"u": -v}),
    },
    contacts={"hit": mbs.Contact(["ball", "racket.strings"], restitution=e)},
    impact="closing",
)

if __name__ == "__main__":
    print(f"u_x = {mbs.solve(system).impact.after['u_x']}")
