"""A chain of six rods on ball joints: the twin of spatial_chain.yaml in Python."""

import multibody_sym as mbs

RODS = 6
(g,) = mbs.parameters("g", [9.81])
m, l, r = mbs.parameters("m l r", ["200 g", "25 cm", "1 cm"], positive=True)
bend, push = mbs.parameters("bend push", ["20 deg", 0.5])
rod = mbs.Body(shape={"cylinder": [r, l], "mass": m}, com=[0, 0, -l / 2], points={"end": [0, 0, -l]})
start = {"q": [mbs.cos(bend / 2), mbs.sin(bend / 2), 0, 0], "u": [0, push, 0]}


def joint(k: int) -> mbs.Spherical:
    """Return the joint that carries rod k."""
    return mbs.Spherical("ground" if k == 1 else f"rod{k - 1}.end", f"rod{k}", initial=start)


system = mbs.System(
    "spatial_chain",
    description="A chain of six rods on ball joints is let go as an arc and pushed sideways. It swings in space.",
    gravity=[0, 0, -g],
    bodies={f"rod{k}": rod for k in range(1, RODS + 1)},
    joints={f"joint{k}": joint(k) for k in range(1, RODS + 1)},
    outputs={
        "vertical": "angular_momentum(z)",
        "energy": "total_energy()",
        "end": f"position(rod{RODS}.end, z)",
    },
    simulation={"t_end": "3 s"},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"the free end is at z = {run['end'][-1]:.6f} m in the end")
