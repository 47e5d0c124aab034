"""A chain of ten links: the twin of chain.yaml in Python, where a loop does what `repeat` does in the file."""

import multibody_sym as mbs

LINKS = 10
(g,) = mbs.parameters("g", [9.81])
m, l = mbs.parameters("m l", ["100 g", "20 cm"], positive=True)
(bend,) = mbs.parameters("bend", ["15 deg"])


def joint(k: int) -> mbs.Revolute:
    """Return the joint that carries link k."""
    parent = "ground" if k == 1 else f"link{k - 1}.end"
    return mbs.Revolute(parent, f"link{k}", axis="z", initial={"q": bend})


system = mbs.System(
    "chain",
    description="A chain of ten links, written once and repeated. It starts as an arc and falls.",
    gravity=[0, -g, 0],
    bodies={f"link{k}": mbs.Body(mass=m, com=[0, -l, 0], points={"end": [0, -l, 0]}) for k in range(1, LINKS + 1)},
    joints={f"joint{k}": joint(k) for k in range(1, LINKS + 1)},
    outputs={"end_height": f"position(link{LINKS}.end, y)", "energy": "total_energy()"},
    simulation={"t_end": "3 s"},
)

if __name__ == "__main__":
    print(f"the free end is at y = {mbs.simulate(system)['end_height'][-1]:.6f} m in the end")
