"""A block on a shaken rough belt for 50 periods: located switches against smoothed friction, at the best error of each.

    python benchmarks/shaken_belt.py [seconds]

One coefficient of friction; the belt's largest acceleration is three times what friction gives, so that the block
sticks and slips both ways in each period. The exact motion is piecewise a parabola or the belt's own, with switching
times to rounding. Per tool: the largest error of the block's position at 1001 times over the belt's amplitude, and CPU
seconds; of each the most accurate of several settings that take at most so many seconds (default 60), and its CPU time
over that of this package at no larger an error. scipy integrates friction mu m g tanh(v / e). Ours includes building
the model and all decisions at switches; code is compiled before.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import multibody_sym as mbs

MU, G, W, PERIODS = 0.3, 9.81, 4 * math.pi, 50
A = 3 * MU * G / W**2
END = PERIODS * 2 * math.pi / W
TIMES = np.arange(1001) * END / 1000
Result = tuple[float, float, str]
"""Error, CPU seconds, setting."""

MODEL = f"""
multibody_sym: 1
name: shaken_belt
gravity: [0, -{G}, 0]
parameters: {{A: {A!r}, w: {W!r}}}
bodies:
  block: {{mass: 1}}
  belt: {{mass: 1, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}
joints:
  slide: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: [A*w, 0]}}}}
  shake: {{type: prismatic, parent: ground, child: belt, axis: x, motion: A*sin(w*t)}}
contacts:
  c: {{between: [block, belt.top], static: {MU}, kinetic: {MU}}}
"""


def exact() -> np.ndarray:
    """Return the block's positions at TIMES."""
    t, x, v, slip = 0.0, 0.0, A * W, 0.0
    pieces = []
    while t < END:
        if slip:
            t0, x0, v0 = t, x, v

            def gap(s: float, v0: float = v0, t0: float = t0, slip: float = slip) -> float:
                return slip * (v0 - slip * MU * G * (s - t0) - A * W * math.cos(W * s))

            places = t0 + np.linspace(1e-6, 1.0, 4001) * 2 * math.pi / W
            k = next(i for i, s in enumerate(places) if gap(s) < 0.0)
            end = brentq(gap, places[k - 1], places[k], xtol=1e-16, rtol=1e-15)
            half = slip * MU * G / 2
            pieces.append((t0, end, lambda s, x=x0, v=v0, t=t0, c=half: x + v * (s - t) - c * (s - t) ** 2))
            t, x, v = end, pieces[-1][2](end), A * W * math.cos(W * end)
            pull = -A * W * W * math.sin(W * end)
            slip = -math.copysign(1.0, pull) if abs(pull) > MU * G else 0.0
        else:
            phase, limit = W * t, math.asin(MU * G / (A * W * W))
            half = math.floor(phase / math.pi)
            end = (half * math.pi + limit) / W
            end = end if end > t else ((half + 1) * math.pi + limit) / W
            pieces.append((t, end, lambda s, x=x, t=t: x + A * (math.sin(W * s) - math.sin(W * t))))
            x, v, t = pieces[-1][2](end), A * W * math.cos(W * end), end
            slip = math.copysign(1.0, math.sin(W * end + 1e-9))
    found = [next(f(s) for a, b, f in pieces if a <= s <= b) for s in TIMES]
    return np.array(found)


def measured(run: Callable[[], np.ndarray], reference: np.ndarray, setting: str) -> Result:
    """Return the error and the CPU time of a run that returns positions at TIMES."""
    begin = time.process_time()
    x = run()
    spent = time.process_time() - begin
    return float(np.abs(x - reference).max() / A), spent, setting


def ours(reference: np.ndarray) -> Iterator[Result]:
    """Yield runs of this package by tolerance."""
    for rtol in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11):

        def run(rtol: float = rtol) -> np.ndarray:
            return np.array(mbs.simulate(mbs.loads(MODEL), t_end=END, rtol=rtol, samples=1001)["x"])

        run()
        yield measured(run, reference, f"rtol {rtol:g}")


def scipys(reference: np.ndarray) -> Iterator[Result]:
    """Yield runs of scipy on smoothed friction."""
    for method in ("LSODA",):
        for exponent in range(2, 9):
            e = A * W * 10.0**-exponent

            def slope(t: float, y: np.ndarray, e: float = e) -> list[float]:
                return [y[1], -MU * G * math.tanh((y[1] - A * W * math.cos(W * t)) / e)]

            def run(e: float = e, method: str = method) -> np.ndarray:
                how = {"method": method, "rtol": 1e-10, "atol": 1e-13, "max_step": 0.05 / W, "t_eval": TIMES}
                return np.array(solve_ivp(slope, (0.0, END), [0.0, A * W], **how).y[0])

            yield measured(run, reference, f"{method}, e = {e:.1g} m/s")


def best(results: Iterator[Result], limit: float) -> Result:
    """Return the most accurate run among those that take no longer than a limit, and print all."""
    kept = (math.inf, math.inf, "none")
    for result in results:
        print(f"    {result[2]:48} error {result[0]:.2e}  {result[1]:8.3f} s", flush=True)
        kept = min(kept, result, key=lambda one: one[0]) if result[1] <= limit else kept
        if result[1] > limit:
            break
    return kept


def main(limit: float) -> None:
    """Print all runs, and how much more CPU the best of the others takes."""
    reference = exact()
    print("multibody_sym")
    own = list(ours(reference))
    for error, spent, setting in own:
        print(f"    {setting:48} error {error:.2e}  {spent:8.3f} s")
    for name, runs in (("scipy", scipys),):
        print(name)
        error, spent, setting = best(runs(reference), limit)
        fitting = [one[1] for one in own if one[0] <= error]
        told = f"{spent / min(fitting):.0f} times our CPU time" if fitting else "more accurate than ours"
        print(f"    best: {setting}, error {error:.2e}, {spent:.3f} s: {told}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
