"""Block L^T D L along the tree: M^-1 applied in time linear in the number of bodies, M never formed.

The mass matrix of a tree factorises along it; its pivots are those of each joint's V = A^T M* A, where M* is the
articulated inertia of everything the joint carries. V is never inverted: the freedoms of a joint are eliminated one by
one, which is V's own L D L^T, and each takes its symmetric share U U^T / d from M* (21 elements).

Sources: Vereshchagin (1974); Shimanovskii (2017); Featherstone, Rigid Body Dynamics Algorithms, chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from multibody_sym.dynamics.formalisms.body_axes import BodyAxes, along_body_axes
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.formalisms.massless import verify_massive
from multibody_sym.dynamics.formalisms.recursion import recursive_dynamics
from multibody_sym.dynamics.inertia.articulated import Inertia, articulated
from multibody_sym.dynamics.inertia.base_parameters import base_inertias
from multibody_sym.kinematics.alignment import economical_motion
from multibody_sym.kinematics.motion import BodyMotion, Motion, from_parent
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.wrenches import Wrench, to_parent
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, dot, scale, subtract


def block_ldl(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics at a state. Raises NoSolutionError where a freedom without mass is left to rows to hold."""
    verify_massive(mechanism, "block_ldl")
    motion = economical_motion(mechanism, state)
    return recursive_dynamics(motion, tree_factors(motion))


@dataclass(frozen=True)
class Freedom:
    """One eliminated freedom of a body: its speed, partial velocity A, pivot d and gain K = U / d."""

    speed: int
    linear: Vec
    angular: Vec
    pivot: S
    gain: Wrench


@dataclass(frozen=True)
class TreeFactors:
    """The factorised mass matrix of a tree: the freedoms of each body in tree order, free bodies `along` their axes."""

    motion: Motion
    freedoms: tuple[tuple[Freedom, ...], ...]
    along: tuple[BodyAxes, ...]

    def solve(self, right: Sequence[S]) -> list[S]:
        """Return M^-1 right (n)."""
        return self.accelerations(right, [_NOTHING] * len(self.freedoms))

    def accelerations(self, of_speed: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        """Return M^-1 (Q + sum of A^T R) (n) for forces Q on the speeds and wrenches R on the bodies."""
        remaining = self._inward(of_speed, of_body)
        return self._outward([e / d for e, d in zip(remaining, self._pivots(), strict=True)])

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T right (n)."""
        remaining = self._inward(right, [_NOTHING] * len(self.freedoms))
        return [e if e is ZERO else e * root for e, root in zip(remaining, self._roots, strict=True)]

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 D^-1/2 x (n)."""
        return self._outward([value * root for value, root in zip(x, self._roots, strict=True)])

    @cached_property
    def _roots(self) -> list[S]:
        return [1 / sqrt(d) for d in self._pivots()]

    def _pivots(self) -> list[S]:
        return [freedom.pivot for of_body in self.freedoms for freedom in of_body]

    def _inward(self, right: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        """Return e = Q + A^T p of every freedom, from the leaves to the root; p -= K e."""
        for axes in self.along:
            right = axes.forces(right)
        carried, remaining = list(of_body), list(right)
        for index in range(len(carried) - 1, -1, -1):
            if carried[index] is _NOTHING and all(right[freedom.speed] is ZERO for freedom in self.freedoms[index]):
                continue
            left, wrench = inward(self.freedoms[index], right, carried[index])
            for freedom, e in zip(self.freedoms[index], left, strict=True):
                remaining[freedom.speed] = e
            parent = self.motion.mechanism.bodies[index].parent
            if parent >= 0:
                handed, known = to_parent(self.motion.bodies[index], wrench), carried[parent]
                carried[parent] = add(known[0], handed[0]), add(known[1], handed[1])
        return remaining

    def _outward(self, x: Sequence[S]) -> list[S]:
        """Return udot from x = e / d, from the root to the leaves: udot = x - K . a, a += A udot."""
        udot = list(x)
        reached: list[tuple[Vec, Vec]] = []
        for index, body in enumerate(self.motion.mechanism.bodies):
            above = from_parent(self.motion.bodies[index], reached[body.parent]) if body.parent >= 0 else _NOTHING
            rates, here = outward(self.freedoms[index], x, above)
            for freedom, rate in zip(self.freedoms[index], rates, strict=True):
                udot[freedom.speed] = rate
            reached.append(here)
        for axes in self.along:
            udot = axes.rates(udot)
        return udot


def inward(freedoms: Sequence[Freedom], right: Sequence[S], wrench: Wrench) -> tuple[list[S], Wrench]:
    """Return e = Q + A^T p of each freedom of a body, the last first eliminated, and what is left of its wrench p."""
    force, moment = wrench
    remaining = []
    for freedom in reversed(freedoms):
        e = right[freedom.speed] + (dot(freedom.linear, force) + dot(freedom.angular, moment))
        remaining.append(e)
        lost = _scaled(freedom.gain, e)
        force, moment = subtract(force, lost[0]), subtract(moment, lost[1])
    return remaining[::-1], (force, moment)


def outward(freedoms: Sequence[Freedom], x: Sequence[S], above: tuple[Vec, Vec]) -> tuple[list[S], tuple[Vec, Vec]]:
    """Return udot of each freedom of a body and the accelerations it reaches, from those without them."""
    a, alpha = above
    rates = []
    for freedom in freedoms:
        rate = x[freedom.speed] - (dot(freedom.gain[0], a) + dot(freedom.gain[1], alpha))
        a, alpha = add(a, scale(rate, freedom.linear)), add(alpha, scale(rate, freedom.angular))
        rates.append(rate)
    return rates, (a, alpha)


def tree_factors(motion: Motion) -> TreeFactors:
    """Return the factors of a tree's mass matrix, from the leaves to the root."""
    motion, along = along_body_axes(motion)
    inertias = [articulated(rigid) for rigid in base_inertias(motion)]
    freedoms: list[tuple[Freedom, ...]] = [()] * len(inertias)
    for index in range(len(inertias) - 1, -1, -1):
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        freedoms[index], left = eliminated(body.u, moved, inertias[index])
        if body.parent >= 0:
            inertias[body.parent] = inertias[body.parent].plus(left.moved(moved.R_PB, moved.p_PB))
    return TreeFactors(motion, tuple(freedoms), along)


def eliminated(speeds: Sequence[int], moved: BodyMotion, inertia: Inertia) -> tuple[tuple[Freedom, ...], Inertia]:
    """Return a joint's freedoms, the last eliminated first, and the inertia that the parent feels through it."""
    freedoms = []
    for speed, linear, angular in reversed(list(zip(speeds, moved.linear, moved.angular, strict=True))):
        force, moment = inertia.wrench(linear, angular)
        pivot = dot(linear, force) + dot(angular, moment)
        gain = _over(force, pivot), _over(moment, pivot)
        freedoms.append(Freedom(speed, linear, angular, pivot, gain))
        inertia = inertia.without((force, moment), gain)
    return tuple(reversed(freedoms)), inertia


def _over(u: Vec, pivot: S) -> Vec:
    """Return U / d; the component that is the pivot itself becomes an exact 1."""
    inverse = 1 / pivot
    x, y, z = (1 if component is pivot else component * inverse for component in u)
    return x, y, z


def _scaled(wrench: Wrench, factor: S) -> Wrench:
    return scale(factor, wrench[0]), scale(factor, wrench[1])


_NOTHING = (ZERO_VECTOR, ZERO_VECTOR)
