"""Robots from their URDF files: degrees of freedom, operations and time of the forward dynamics; one falls.

    pip install example-robot-data
    python examples/robots.py            # or the names of some, such as UR5; Talos compiles for about a minute
"""

import sys
import time
import warnings
from importlib.metadata import files

import numpy as np

import multibody_sym as mbs

ROBOTS = {  # the end of the file's path, and whether the root link moves freely
    "UR5": ("ur_description/urdf/ur5_robot.urdf", False),
    "Panda": ("panda_description/urdf/panda.urdf", False),
    "ANYmal": ("anymal_b_simple_description/robots/anymal.urdf", True),
    "Talos": ("talos_data/robots/talos_full_v2.urdf", True),
}


def robot(name: str) -> mbs.System:
    """Return a robot of the installed package example-robot-data as a System; joints that mimic others are free."""
    ending, floating = ROBOTS[name]
    path = next(file.locate() for file in files("example-robot-data") if str(file).endswith(ending))
    return mbs.load_urdf(path, floating=floating, mimic=False)


def evaluation(system: mbs.System) -> str:
    """Return the size of the accelerations' code, and their time per state in a batch."""
    rates = mbs.function(system, "state_derivative", native=True)
    speeds, count, rng = len(mbs.mechanism(system).speeds), 1000, np.random.default_rng(0)
    q = rng.uniform(-1, 1, (count, len(mbs.mechanism(system).coordinates)))
    u = rng.normal(size=(count, speeds))
    rates(0.0, q, u)
    seconds = []
    for _ in range(20):
        start = time.perf_counter()
        rates(0.0, q, u)
        seconds.append(time.perf_counter() - start)
    return (
        f"{speeds} degrees of freedom: {rates.operations.total} operations, {rates.operations.functions} functions, "
        f"{min(seconds) / count * 1e6:.2f} us"
    )


def fall(system: mbs.System) -> None:
    """Let a robot without drives fall for a second."""
    run = mbs.simulate(system, t_end=1, rtol=1e-10)
    print("falling for a second, it turns")
    for joint in mbs.mechanism(system).coordinates:
        print(f"  {joint.name:20} to {np.degrees(run[joint.name][-1]):8.2f} deg")
    print(f"and changes its energy by at most {run.drift['energy']:.1e} J")


if __name__ == "__main__":
    warnings.simplefilter("ignore", mbs.UrdfNotice)  # what the files say beside masses and joints
    names = sys.argv[1:] or list(ROBOTS)
    for name in names:
        print(f"{name}: {evaluation(robot(name))}")
    if "UR5" in names:
        fall(robot("UR5"))
