"""The theorems in integral form along a short run: changes against impulses and work, by one method for both.

State and integrals of the causes go on together by steps of order 8 in floats, without Programs, so that the two differ
by rounding only; what a force leaves out of momentum or energy adds up.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from multibody_sym.analysis.theorems.balance import NEGLIGIBLE
from multibody_sym.analysis.theorems.program import INTEGRAL, THEOREMS
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.programs.exertions import exertions, resultant
from multibody_sym.dynamics.programs.momenta import angular_momentum, body_momenta
from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.integrators.methods.dormand_prince_8 import dormand_prince_8
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import constraint_jacobian
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.numerics.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.numerics.rank import SWITCHED, rank
from multibody_sym.scalars.node import slot
from multibody_sym.scalars.traversal import leaves

MOST: Final = 60
"""Speeds beyond which the short run would take seconds."""
_STEPS: Final = 2
_PART: Final = 0.02
"""The part of the shortest time that speeds and accelerations tell of which a step is long: of order 8, it is exact."""


def short_run_misses(mechanism: Mechanism, formalism: Formalism, state: State) -> dict[str, float]:
    """Return by how much impulse, angular impulse and work miss the changes along a short run from a state.

    Relative to the integrals of absolute values of all causes and of what they change, which counts by the second.
    A force that is left out misses by the same part in shorter runs, the method by less: the least miss is returned.
    Empty where something declared has no value soon after that state, where a force has a kink or jumps so soon that
    no shorter run ends before, where constraints depend on each other at that state but no more soon after, so that its
    accelerations do not last, and for more than `MOST` speeds.
    """
    least: dict[str, float] = {}
    if len(mechanism.speeds) > MOST:
        return least
    try:
        for part in (_PART, _PART / 30.0, _PART / 1000.0):
            found = _misses(mechanism, formalism, state, part)
            if found is not None:
                least = {name: min(least.get(name, math.inf), x) for name, x in found.items()}
                if max(least.values()) <= NEGLIGIBLE:
                    break
    except (*UNDEFINED, MultibodyError):
        return least
    return least


def _misses(mechanism: Mechanism, formalism: Formalism, state: State, part: float) -> dict[str, float] | None:
    """Return them for a run whose steps are a part of the shortest time; None where it comes over a kink.

    Raises NoSolutionError where other constraints are independent at its end than at its start.
    """
    run = _Run(mechanism, formalism, state)
    q, u, t = (np.array(x, dtype=float) for x in (state.q, state.u, state.slots[TIME]))
    rates = run.rates(float(t), q, u)
    fastest = max(float(np.abs(u).max(initial=0.0)), float(np.sqrt(np.abs(rates[1]).max(initial=0.0))))
    h = part / (1.0 + fastest)
    sides = run.sides(float(t), q, u)
    begin, adding, sizes = _values(run.motion(float(t), q, u)), np.zeros(7), np.zeros(7)
    for _ in range(_STEPS):
        q, u, adding, sizes = _stepped(run, float(t), h, (q, u, adding, sizes))
        t = t + h
        if (run.sides(float(t), q, u) != sides).any():
            return None
    if run.rank(float(t), q, u) != run.rank(float(state.slots[TIME]), *map(np.array, (state.q, state.u))):
        raise NoSolutionError("the motion begins in a singular position")
    end = run.motion(float(t), q, u)
    missed = np.abs(_values(end) - begin - adding)
    sizes[6] = max(sizes[6], _rounding(end, sizes))
    found = {}
    for name, own in THEOREMS.items():
        size = float(sizes[own].max())
        found[INTEGRAL[name]] = 0.0 if not missed[own].any() else float(missed[own].max()) / size
    return found


def _rounding(motion: Motion, sizes: Floats) -> float:
    """Return the kinetic energy of bodies at rest: their speeds round to sqrt(eps) of those that all forces could give.

    With the impulse p of absolute forces (in `sizes`) and the mass m of all bodies these are p/m.
    """
    mass = sum(abs(float(each.mass)) for each in motion.masses)
    return EPSILON * float(sizes[:3].sum()) ** 2 / mass if mass else 0.0


_Integrated = tuple[Floats, Floats, Floats, Floats]


def _stepped(run: _Run, t: float, h: float, x: _Integrated) -> _Integrated:
    """Return q, u and the integrals of causes and sizes after a step of order 8."""
    method, slopes = dormand_prince_8(), list[_Integrated]()
    for row, c in zip(method.A[:-1], method.c, strict=False):
        at = _moved(x, slopes, [h * float(a) for a in row])
        slopes.append(run.rates(t + h * float(c), at[0], at[1]))
    last = [h * float(b) for b in method.A[-1]]  # the last stage is where the next step begins
    return _moved(x, slopes, last)


def _moved(x: _Integrated, slopes: list[_Integrated], weights: list[float]) -> _Integrated:
    q, u, adding, sizes = (
        part + sum((w * slope[k] for w, slope in zip(weights, slopes, strict=False)), np.zeros_like(part))
        for k, part in enumerate(x)
    )
    return q, u, adding, sizes


class _Run:
    """A mechanism's motion by a formalism, with the parameters of a state."""

    def __init__(self, mechanism: Mechanism, formalism: Formalism, state: State) -> None:
        self._mechanism, self._formalism = mechanism, formalism
        self._parameters = [state.slots[slot("parameters", k)] for k in range(len(mechanism.parameters))]

    def sides(self, t: float, q: Floats, u: Floats) -> Floats:
        """Return the signs of what switches in forces and motions (kinks)."""
        motion, kinks = self.motion(t, q, u), self._mechanism.kinks
        found = motion.state.values(kinks, quantities(motion, (), (), leaves(kinks, "quantity")))
        return np.asarray(np.sign(found), dtype=float)

    def motion(self, t: float, q: Floats, u: Floats) -> Motion:
        """Return the motion of all bodies."""
        return motion_of(self._mechanism, self._state(t, q, u))

    def rank(self, t: float, q: Floats, u: Floats) -> int:
        """Return how many constraints are independent."""
        rows = self._formalism(self._mechanism, self._state(t, q, u)).rows
        return rank(constraint_jacobian(rows), SWITCHED) if rows else 0

    def rates(self, t: float, q: Floats, u: Floats) -> _Integrated:
        """Return qdot, udot, the causes of the changes of P, L and T, and the sizes (7) of all terms."""
        dynamics = self._formalism(self._mechanism, self._state(t, q, u))
        motion, found = self.motion(t, q, u), forward_dynamics(dynamics)
        acting = exertions(motion, found.udot.tolist(), dynamics.rows, found.multipliers.tolist())
        outside = [resultant(motion, each.of_body) for each in acting if each.from_outside]
        forces = np.array([[*force, *moment] for force, moment in outside], dtype=float).reshape(-1, 6)
        powers = np.array([each.power for each in acting], dtype=float)
        causes = np.append(forces.sum(axis=0), powers.sum())
        parts = [[*part.momentum, *angular_momentum([part])] for part in body_momenta(motion)]
        content = np.abs(np.array(parts, dtype=float).reshape(-1, 6)).sum(axis=0)
        size = np.append(np.abs(forces).sum(axis=0) + content, np.abs(powers).sum() + float(kinetic_energy(motion)))
        far = max((float(np.linalg.norm(np.array(p, dtype=float))) for _, p in motion.poses), default=0.0)
        size[3:6] += far * size[:3].sum()
        return np.array(dynamics.rates, dtype=float), found.udot, causes, size

    def _state(self, t: float, q: Floats, u: Floats) -> State:
        return state_of(self._mechanism, float, t, q.tolist(), u.tolist(), self._parameters)


def _values(motion: Motion) -> Floats:
    """Return P, L about the origin and T (7)."""
    parts = [[*part.momentum, *angular_momentum([part])] for part in body_momenta(motion)]
    found: Floats = np.append(np.array(parts, dtype=float).reshape(-1, 6).sum(axis=0), float(kinetic_energy(motion)))
    return found
