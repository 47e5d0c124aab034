"""A sampled controller: a rod is held upright by a torque that is computed every 1 ms, or too seldom.

Run it: `python examples/control/sampled.py`.
"""

import numpy as np

import multibody_sym as mbs

P, D = 60.0, 8.0  # N*m/rad, N*m*s/rad
ROD = mbs.System(
    "rod",
    gravity=[0, -9.81, 0],
    bodies={"rod": mbs.Body(shape={"rod": 1, "mass": 1})},
    joints={"hinge": mbs.Revolute("ground", "rod", q="a", initial={"q": "80 deg"})},
    inputs={"tau": 0},
    forces={"motor": mbs.Torque(mbs.variable("tau"), joint="hinge")},
)


def held_up(every: float) -> tuple[mbs.Trajectory, float]:
    """Return 4 s with a sample so often, and by which factor the linear model shrinks errors from sample to sample."""
    law = {"tau": lambda t, q, u: P * (np.pi / 2 - q[0]) - D * u[0], "every": every}
    near = mbs.linearize(ROD, at={"a": "90 deg"}).discrete(every)
    return mbs.simulate(ROD, t_end=4, inputs=law), float(np.abs(np.linalg.eigvals(near.A - near.B @ [[P, D]])).max())


if __name__ == "__main__":
    for seconds in (0.001, 0.02, 0.05, 0.09):
        run, factor = held_up(seconds)
        end = np.rad2deg(run["a"][-1])
        print(f"every {1000 * seconds:g} ms: {end:.3f} deg after 4 s, errors times {factor:.3f} a sample")
