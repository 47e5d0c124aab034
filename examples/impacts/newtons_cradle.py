"""Five balls in a row: the twin of newtons_cradle.yaml in Python."""

import multibody_sym as mbs

m, r, v = mbs.parameters("m r v", ["1 kg", "0.05 m", "2 m/s"], positive=True)
(e,) = mbs.parameters("e", [1])
balls = range(1, 6)


def rail(k: int) -> mbs.Prismatic:
    initial = {"u": v} if k == 1 else {"q": 2 * (k - 1) * r, "u": 0}
    return mbs.Prismatic("ground", f"b{k}", axis="x", q=f"x{k}", initial=initial)


system = mbs.System(
    "newtons_cradle",
    description="Five equal balls touch, and the first arrives with the speed v. Which of them move off?",
    gravity=[0, 0, 0],
    bodies={f"b{k}": mbs.Body(mass=m, surfaces={"skin": mbs.Surface(sphere=r)}) for k in balls},
    joints={f"J{k}": rail(k) for k in balls},
    contacts={f"c{k}": mbs.Contact([f"b{k + 1}.skin", f"b{k}.skin"], restitution=e) for k in range(1, 5)},
    impact="closing",
    simulation=mbs.Settings(t_end="0.5 s"),
)

if __name__ == "__main__":
    for speed, after in mbs.solve(system).impact.after.items():
        print(f"{speed} = {after}")
