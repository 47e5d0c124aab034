"""Mechanisms of one freedom that pass positions in which their rows become dependent, and their motion by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import multibody_sym as mbs

R, L, M_CRANK, M_TABLE, G = 0.3, 0.5, 1.0, 4.0, 9.81
BAR = f"{{shape: {{rod: {R}, mass: {M_CRANK}}}, points: {{end: [{R}, 0, 0]}}}}"


def cranks(count: int) -> str:
    """Return a table on so many parallel cranks: flat, it may go on as a parallelogram or folded."""
    last = (count - 1) * L
    points = ", ".join(f"p{k}: [{k * L}, 0, 0]" for k in range(1, count))
    lines = [f"  crank{k}: {BAR}" for k in range(count)]
    joints = [
        f"  A{k}: {{type: revolute, parent: ground.p{k}, child: crank{k}, axis: z, q: phi{k}, initial: {{q: start}}}}\n"
        f"  B{k}: {{type: revolute, parent: crank{k}.end, child: table.p{k}, axis: z, cut: true}}"
        for k in range(1, count)
    ]
    return f"""
bodies:
  ground: {{points: {{{points}}}}}
{chr(10).join(lines)}
  table: {{shape: {{rod: {last}, mass: {M_TABLE}}}, points: {{{points}}}}}
joints:
  A: {{type: revolute, parent: ground, child: crank0, axis: z, q: phi, initial: {{q: start, u: speed, known: true}}}}
  B: {{type: revolute, parent: crank0.end, child: table, axis: z, q: psi, initial: {{q: -start}}}}
{chr(10).join(joints)}
"""


SLIDER = f"""
bodies:
  crank: {BAR}
  rod: {BAR}
  slider: {{mass: 2}}
joints:
  A: {{type: revolute, parent: ground, child: crank, axis: z, q: phi, initial: {{q: start, u: speed, known: true}}}}
  B: {{type: revolute, parent: crank.end, child: rod, axis: z, q: psi, initial: {{q: -2*start}}}}
  D: {{type: prismatic, parent: ground, child: slider, axis: x, q: s, initial: {{q: "{2 * R}*cos(start)"}}}}
  C: {{type: revolute, parent: rod.end, child: slider, axis: z, cut: true}}
"""


@dataclass(frozen=True)
class Mechanism:
    """A mechanism as text; by the crank's angle phi: reduced inertia and its slope, torque of weight / -g, the
    other coordinates.

    Rows become dependent where `crossing(phi)` is zero.
    """

    text: str
    inertia: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    weight: Callable[[Any], Any]
    others: dict[str, Callable[[Any], Any]]
    crossing: Callable[[Any], Any]

    def system(self, torque: str = "0", *, g: float = 0.0, start: object = 1.0, speed: float = 3.0) -> mbs.System:
        """Return the mechanism with a torque on the crank, in weight g."""
        values = f"parameters: {{start: {start}, speed: {speed}}}\n"
        head = f"multibody_sym: 1\nname: mechanism\ngravity: [0, {-g}, 0]\n{values}"
        drive = f"forces:\n  drive: {{type: torque, joint: A, value: {torque}}}\n"
        return mbs.loads(head + self.text + drive)

    def by_hand(
        self, t: np.ndarray, torque: Callable[[float, float], float] = lambda t, phi: 0.0, *, g: float = 0.0,
        start: float = 1.0, speed: float = 3.0
    ) -> np.ndarray:
        """Return phi at the times t from I phi'' + I' phi'^2 / 2 + g w = torque."""

        def rate(t, x):
            push = torque(t, x[0]) - g * self.weight(x[0]) - 0.5 * self.slope(x[0]) * x[1] ** 2
            return [x[1], push / self.inertia(x[0])]

        return solve_ivp(rate, (0, t[-1]), [start, speed], "DOP853", t, rtol=1e-13, atol=1e-13).y[0]


def _table_on(count: int) -> Mechanism:
    others = {name: (lambda phi: phi) for name in (f"phi{k}" for k in range(1, count))}
    return Mechanism(
        cranks(count),
        inertia=lambda phi: (count * M_CRANK / 3 + M_TABLE) * R**2,
        slope=lambda phi: 0.0,
        weight=lambda phi: (count * M_CRANK / 2 + M_TABLE) * R * np.cos(phi),
        others={**others, "psi": lambda phi: -phi},
        crossing=np.sin,
    )


MECHANISMS = {
    "parallelogram": _table_on(2),
    "three cranks": _table_on(3),
    "equal slider-crank": Mechanism(
        SLIDER,
        inertia=lambda phi: R**2 * (2 / 3 + 10 * np.sin(phi) ** 2),
        slope=lambda phi: R**2 * 20 * np.sin(phi) * np.cos(phi),
        weight=lambda phi: R * np.cos(phi),
        others={"psi": lambda phi: -2 * phi, "s": lambda phi: 2 * R * np.cos(phi)},
        crossing=np.cos,
    ),
}
