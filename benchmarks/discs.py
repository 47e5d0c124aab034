"""A hundred discs that fall into a box and on each other: start, CPU time, stages, overlap, memory; MuJoCo beside.

    python benchmarks/discs.py [discs] [seconds]

Ten columns of discs stand a little apart, friction 0.3, restitution 0.2 (default: 100 discs, 2 s). Ours: CPU time to
prepare the run (compilers too) and to run it, what its stages take by the clock, the largest overlap (m) and the
largest rise of the energy (J) from sample to sample, memory of the process. MuJoCo has contacts with `solref` as
stiffness and damping, by step and by how many steps a contact lasts; overlap and rises are those of its steps.

What is not installed (the extra `peers`) is left out with a line.
"""

from __future__ import annotations

import importlib.util
import math
import resource
import sys
import time
from importlib.metadata import version
from itertools import product

import numpy as np

import multibody_sym as mbs
from multibody_sym.stages import time_stages

RADIUS, INERTIA, HALF, MU, E = 0.2, 0.016, 2.1, 0.3, 0.2
GRAVITY = 9.81
COLUMNS = 10


def starts(count: int) -> np.ndarray:
    """Return the places (count, 2) of the discs at the start."""
    row, column = np.divmod(np.arange(count), COLUMNS)
    return np.column_stack([-1.85 + 0.401 * column + 0.05 * (row % 2), 0.21 + 0.401 * row])


def cpu() -> float:
    """Return the CPU time (s) of this process and of the compilers that it waited for."""
    spent = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in spent)


def overlap(x: np.ndarray) -> float:
    """Return how far (m) discs at places x (count, 2) are inside each other or the walls, at most."""
    apart = np.linalg.norm(x[:, None] - x, axis=2)[np.triu_indices(len(x), 1)] - 2 * RADIUS
    walls = np.concatenate([x[:, 1], x[:, 0] + HALF, HALF - x[:, 0]]) - RADIUS
    return -min(float(apart.min(initial=0.0)), float(walls.min()), 0.0)


def energy(x: np.ndarray, u: np.ndarray) -> float:
    """Return the energy (J) of discs at places x (count, 2) with speeds u (count, 3)."""
    return float((u[:, :2] ** 2).sum() / 2 + INERTIA * (u[:, 2] ** 2).sum() / 2 + GRAVITY * x[:, 1].sum())


def model(count: int) -> mbs.System:
    """Return our model, with a contact for each pair of discs and of a disc and a wall."""
    walls = {
        "floor": mbs.Surface(plane=[0, 0, 0], normal="y"),
        "left": mbs.Surface(plane=[-HALF, 0, 0], normal="x"),
        "right": mbs.Surface(plane=[HALF, 0, 0], normal="-x"),
    }
    bodies, joints, contacts = {"ground": mbs.Body(surfaces=walls)}, {}, {}
    law = {"static": MU, "kinetic": MU, "restitution": E}
    for i, (x, y) in enumerate(starts(count).tolist()):
        bodies[f"b{i}"] = mbs.Body(mass=1, inertia={"Izz": INERTIA}, surfaces={"rim": mbs.Surface(disc=RADIUS)})
        joints[f"j{i}"] = mbs.Planar("ground", f"b{i}", q=[f"x{i}", f"y{i}", f"t{i}"], initial={"q": [x, y, 0]})
        contacts |= {f"c{i}_{wall}": mbs.Contact(between=[f"b{i}.rim", f"ground.{wall}"], **law) for wall in walls}
        contacts |= {f"c{i}_{k}": mbs.Contact(between=[f"b{i}.rim", f"b{k}.rim"], **law) for k in range(i)}
    return mbs.System("discs", gravity=[0, -GRAVITY, 0], bodies=bodies, joints=joints, contacts=contacts)


def ours(count: int, seconds: float) -> float:
    """Print what our run takes; return its CPU time (s)."""
    begin = cpu()
    with time_stages("other") as times:
        prepared = mbs.prepare(model(count), t_end=seconds, samples=201)
        begun = cpu()
        run = prepared.run()
    spent = cpu() - begun
    x = np.stack([run.q[:, 0::3], run.q[:, 1::3]], axis=2)
    energies = [energy(*each) for each in zip(x, run.u.reshape(len(run.t), -1, 3), strict=True)]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"    start {begun - begin:.1f} s of CPU, {seconds:g} s of motion {spent:.1f} s, {len(run.events)} events")
    print(f"    {times}")
    print(f"    overlap {max(map(overlap, x)):.1e} m, energy rises by {max(np.diff(energies)):.1e} J, {memory:.2f} GB")
    print(f"    energy account {run.energy_residual:.1e} J, fastest at the end {np.abs(run.u[-1]).max():.1e}")
    return spent


def mujocos(count: int, seconds: float, own: float) -> None:
    """Print what runs of MuJoCo take, by step and by how many of them a contact lasts."""
    import mujoco

    loss = -math.log(E)
    damping = loss / math.hypot(loss, math.pi)
    for step, lasts in product((2e-3, 1e-3, 1e-4), (4, 10, 30)):
        rate = math.pi / (lasts * step)
        solref = f"{-(rate**2)!r} {-2 * damping * rate!r}"
        contact = f'solref="{solref}" solimp=".9999 .9999 .001 .5 2" condim="3" friction="{MU} 0 0"'
        discs = "".join(
            f'<body pos="{x} {y} 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
            f'<joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 {INERTIA}"/>'
            f'<geom type="sphere" size="{RADIUS}" {contact}/></body>'
            for x, y in starts(count).tolist()
        )
        planes = ((0, 0, "-90 0 0"), (-HALF, 0, "0 90 0"), (HALF, 0, "0 -90 0"))
        walls = "".join(
            f'<geom type="plane" size="9 9 1" pos="{x} {y} 0" euler="{turn}" {contact}/>' for x, y, turn in planes
        )
        setting = f'gravity="0 {-GRAVITY} 0" timestep="{step!r}" cone="elliptic"'
        option = f'<option {setting}><flag refsafe="disable"/></option>'
        world = mujoco.MjModel.from_xml_string(
            f'<mujoco><size memory="200M"/>{option}<worldbody>{walls}{discs}</worldbody></mujoco>'
        )
        data, deepest, rises, spent, last = mujoco.MjData(world), 0.0, 0.0, 0.0, math.inf
        for _ in range(round(seconds / step)):
            begin = time.process_time()
            mujoco.mj_step(world, data)
            spent += time.process_time() - begin
            x = data.qpos.reshape(-1, 3)[:, :2] + starts(count)
            now = energy(x, data.qvel.reshape(-1, 3))
            deepest, rises, last = max(deepest, overlap(x)), max(rises, now - last), now
        told = f"step {step:.0e} s, contacts last {lasts:2} steps: {spent:.2f} s of CPU, ours {own / spent:.0f} times"
        print(f"    {told}; overlap {deepest:.1e} m, energy rises by {rises:.1e} J", flush=True)


def main(count: int, seconds: float) -> None:
    """Print what both take."""
    print(f"--- {count} discs, {seconds:g} s\nmultibody_sym")
    own = ours(count, seconds)
    if importlib.util.find_spec("mujoco") is None:
        print("mujoco is not installed: pip install multibody-sym[peers]")
        return
    print(f"mujoco {version('mujoco')}")
    mujocos(count, seconds, own)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, float(sys.argv[2]) if len(sys.argv) > 2 else 2.0)
