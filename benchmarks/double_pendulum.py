"""CPU time of ten seconds of a double pendulum at a final error of 1e-6, against MuJoCo's RK4 in the same run.

    python benchmarks/double_pendulum.py

Both rods are massless, 1 m, with 1 kg at their ends, released from rest: with both joint angles at 90 degrees (a far
more sensitive motion), and with both rods horizontal. The reference is scipy's DOP853 on the textbook's equations in
absolute angles. Needs the extra `peers`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

from multibody_sym.mechanics.model_files import load
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of

MODEL = Path(__file__).parent.parent / "examples" / "double_pendulum.yaml"
WANTED = 1e-6
ROUNDS = 7

MJCF = """
<mujoco>
  <option gravity="0 0 -9.81" integrator="RK4" timestep="{step}"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body>
      <joint type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>
      <body pos="0 0 -1">
        <joint type="hinge" axis="0 1 0"/>
        <inertial pos="0 0 -1" mass="1" diaginertia="1e-14 1e-14 1e-14"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


STARTS = {"joint angles 90 deg, 90 deg": (np.pi / 2, np.pi / 2), "both rods horizontal": (np.pi / 2, 0.0)}


def reference(start: tuple[float, float]) -> np.ndarray:
    """Return both angles from the vertical after ten seconds."""

    def slope(_t: float, x: np.ndarray) -> list[float]:
        a, b, da, db = x
        c, s, g = np.cos(a - b), np.sin(a - b), 9.81
        left = np.array([[2.0, c], [c, 1.0]])
        right = np.array([-s * db**2 - 2 * g * np.sin(a), s * da**2 - g * np.sin(b)])
        return [da, db, *np.linalg.solve(left, right)]

    at_rest = [start[0], start[0] + start[1], 0.0, 0.0]
    return solve_ivp(slope, (0, 10), at_rest, method="DOP853", rtol=1e-13, atol=1e-13).y[:2, -1]


def cheapest(runs: Callable[[float], Callable[[], np.ndarray]], settings: list[float], exact: np.ndarray) -> tuple:
    """Return (setting, error, run) of the first setting, coarse to fine, whose error is at most the wanted one."""
    for setting in settings:
        run = runs(setting)
        error = float(np.abs(run() - exact).max())
        if error <= WANTED:
            return setting, error, run
    raise SystemExit("no setting reaches the wanted error")


def ours(start: tuple[float, float], rtol: float) -> Callable[[], np.ndarray]:
    """Return the compiled loop at a tolerance; it gives the absolute angles at the end."""
    ready = prepare_system(load(MODEL))
    problem = replace(problem_of(ready, settings_of(ready)), q0=np.array(start), rtol=rtol, atol=rtol, samples=2)

    def run() -> np.ndarray:
        q = integrate(problem).q_final
        return np.array([q[0], q[0] + q[1]])

    return run


def theirs(start: tuple[float, float], step: float) -> Callable[[], np.ndarray]:
    """Return MuJoCo's loop in C at a step; it gives the absolute angles at the end."""
    model = mujoco.MjModel.from_xml_string(MJCF.format(step=step))
    data = mujoco.MjData(model)

    def run() -> np.ndarray:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = -np.array(start)
        mujoco.mj_step(model, data, nstep=round(10 / step))
        return -np.array([data.qpos[0], data.qpos[0] + data.qpos[1]])

    return run


def seconds(run: Callable[[], object]) -> float:
    """Return the CPU time of one call."""
    start = time.thread_time()
    run()
    return time.thread_time() - start


def compare(start: tuple[float, float]) -> None:
    """Print both times and their ratio for one start."""
    exact = reference(start)
    tolerances, steps = [10 ** (-k / 4) for k in range(24, 52)], [0.01 / 2 ** (k / 2) for k in range(16)]
    tolerance, our_error, our_run = cheapest(partial(ours, start), tolerances, exact)
    step, their_error, their_run = cheapest(partial(theirs, start), [10 / round(10 / h) for h in steps], exact)
    pairs = [(seconds(our_run), seconds(their_run)) for _ in range(ROUNDS)]
    best_ours, best_theirs = (min(times) for times in zip(*pairs, strict=True))
    print(f"  multibody_sym, rtol = atol = {tolerance:.1e}: error {our_error:.1e}, CPU {best_ours * 1e3:.2f} ms")
    print(f"  MuJoCo, step {step:.1e} s: error {their_error:.1e}, CPU {best_theirs * 1e3:.1f} ms")
    print(f"  ratio {best_theirs / best_ours:.0f}")


def main() -> None:
    """Print the comparison for every start."""
    print(f"multibody_sym {version('multibody-sym')} (dormand_prince), MuJoCo {mujoco.__version__} (RK4)")
    print(f"wanted error {WANTED:.0e}, minimum of {ROUNDS} runs in turn")
    for name, start in STARTS.items():
        print(name)
        compare(start)


if __name__ == "__main__":
    main()
