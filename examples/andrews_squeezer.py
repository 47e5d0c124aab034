"""Andrews' squeezer: the twin of andrews_squeezer.yaml in Python."""

import multibody_sym as mbs

xa, ya, xb, yb, xc, yc = mbs.parameters(
    "xa ya xb yb xc yc", ["-0.06934 m", "-0.00227 m", "-0.03635 m", "0.03273 m", "0.014 m", "0.072 m"]
)
rr, ra, d, da, e, ea = mbs.parameters(
    "rr ra d da e ea", ["0.007 m", "0.00092 m", "0.028 m", "0.0115 m", "0.02 m", "0.01421 m"]
)
zf, fa, zt, ta, tb = mbs.parameters("zf fa zt ta tb", ["0.02 m", "0.01421 m", "0.04 m", "0.02308 m", "0.00916 m"])
ss, sa, sb, sc, sd = mbs.parameters("ss sa sb sc sd", ["0.035 m", "0.01874 m", "0.01043 m", "0.018 m", "0.02 m"])
ue, ua, ub = mbs.parameters("ue ua ub", ["0.04 m", "0.01228 m", "0.00449 m"])
c0, l0, torque = mbs.parameters("c0 l0 torque", ["4530 N/m", "0.07785 m", "0.033 N*m"])


def body(mass: float, x: object, y: object, inertia: float, **points: list[object]) -> mbs.Body:
    return mbs.Body(mass=mass, com=[x, y, 0], inertia={"Izz": inertia}, points=points)


def hinge(parent: str, child: str, q: str, start: float) -> mbs.Revolute:
    return mbs.Revolute(parent, child, axis="z", q=q, initial={"q": start})


system = mbs.System(
    "andrews_squeezer",
    description="Andrews' squeezer: seven bodies in the plane, three loops, a torque on the crank and one spring.",
    bodies={
        "ground": mbs.Body(points={"A": [xa, ya, 0], "B": [xb, yb, 0], "C": [xc, yc, 0]}),
        "K1": body(0.04325, ra, 0, 2.194e-6, end=[rr, 0, 0]),
        "K2": body(0.00365, -da, 0, 4.41e-7, P=[-d, 0, 0]),
        "K3": body(0.02373, sb, -sa, 5.255e-6, P=[0, -ss, 0], D=[sd, -sc, 0]),
        "K4": body(0.00706, 0, ea - e, 5.667e-7, P=[0, -e, 0]),
        "K5": body(0.0705, ta, tb, 1.169e-5, end=[zt, 0, 0]),
        "K6": body(0.00706, zf - fa, 0, 5.667e-7, P=[zf, 0, 0]),
        "K7": body(0.05498, ua, ub, 1.912e-5, end=[0, -ue, 0]),
    },
    joints={
        "O": hinge("ground", "K1", "beta", -0.06171389001427645),
        "O1": hinge("K1.end", "K2", "theta", 0),
        "B": hinge("ground.B", "K3", "gamma", 0.45527981916307037),
        "A5": hinge("ground.A", "K5", "delta", 0.48736497954384256),
        "E": hinge("K5.end", "K4", "phi", 0.22266839016588588),
        "A7": hinge("ground.A", "K7", "epsilon", 1.2305474445498212),
        "F": hinge("K7.end", "K6", "omega", -0.22266839016588588),
        **{f"P{k}": mbs.Revolute("K2.P", f"K{k}.P", axis="z", cut=True) for k in (3, 4, 6)},
    },
    forces={
        "drive": mbs.Torque(torque, joint="O"),
        "spring": mbs.SpringDamper(between=["ground.C", "K3.D"], stiffness=c0, length=l0),
    },
    simulation={"t_end": "0.03 s", "method": "dormand_prince", "rtol": 1e-11, "atol": 1e-13, "samples": 301},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print("beta =", run["beta"][-1], "theta =", run["theta"][-1])
