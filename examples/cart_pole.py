"""A pole on a cart that is pushed to and fro: the twin of cart_pole.yaml in Python."""

import multibody_sym as mbs

(g,) = mbs.parameters("g", [9.81])
M, l, m = mbs.parameters("M l m", ["1 kg", "1 m", "200 g"], positive=True)
F, w = mbs.parameters("F w", ["2 N", 3])
t, push = mbs.variable("t"), mbs.variable("push")

system = mbs.System(
    "cart_pole",
    description="A pole stands on a cart that is pushed to and fro: two joints, one carried by the other.",
    gravity=[0, -g, 0],
    bodies={"cart": mbs.Body(mass=M), "pole": mbs.Body(shape={"rod": l, "mass": m})},
    joints={
        "track": mbs.Prismatic("ground", "cart", axis="x", q="x"),
        "hinge": mbs.Revolute("cart", "pole", axis="z", q="theta", initial={"q": "95 deg"}),
    },
    inputs={"push": F * mbs.cos(w * t)},
    forces={"motor": mbs.Force("cart", [push, 0, 0])},
    outputs={"track_force": "fy(track)", "energy": "total_energy()"},
    simulation={"t_end": "5 s"},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"the cart is at x = {run['x'][-1]:.6f} m after {run.t[-1]:g} s")
