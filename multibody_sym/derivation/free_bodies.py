"""Every body cut free, in symbols: balances of force and moment in which the joints' reactions are unknown.

    m a_C = F + R - sum R_j,   J alpha + omega x J omega = the moments of the same about the centre of mass

Components are those of the body's own reaction: along the axes of its joint's frame on the parent; moments on a body
that a ball carries are along the body's own axes, which makes them Euler's equations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import sympy

from multibody_sym.algebra.simplify import Subexpressions
from multibody_sym.derivation.lagrange import known_nodes
from multibody_sym.derivation.notation import Equation, Symbols
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations, motion_of, partial_velocities, pose, spread
from multibody_sym.mechanics.points import Wrench, generalized_forces
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import slot_state
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    cross,
    dot,
    negate,
    product,
    scale,
    subtract,
    transpose,
)
from multibody_sym.text.printer import COMPONENTS


@dataclass(frozen=True)
class FreeBodies:
    """Each body's name and balances; `joints`: what is left of A^T R = Q where a free direction is along no axis.

    `unknown` are the components of reactions that the equations contain; all others vanish or are a drive's.
    """

    names: tuple[str, ...]
    balances: tuple[tuple[Equation, ...], ...]
    joints: tuple[Equation, ...]
    unknown: tuple[Any, ...]

    @property
    def equations(self) -> tuple[Equation, ...]:
        """All equations, body by body."""
        return (*(equation for balances in self.balances for equation in balances), *self.joints)


def free_bodies(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> FreeBodies:
    """Return the balances of all bodies; those that say no more than that a reaction vanishes are left out."""
    names.budget.enter("the balances of the bodies")
    motion = motion_of(mechanism, slot_state(mechanism))
    found = _Reactions(motion, symbols, names)
    joints = [equation for index in range(len(motion.bodies)) for equation in found.of_joint(index)]
    inward = [found.of_body(index) for index in reversed(range(len(motion.bodies)))]
    balances = tuple(tuple(balance.equation() for balance in of_body) for of_body in reversed(inward))
    written = {s for group in (*balances, joints) for e in group for s in (e.left + e.right).free_symbols}
    unknown = tuple(s for s in symbols.reactions if s in written)
    return FreeBodies(tuple(body.name for body in mechanism.bodies), balances, tuple(joints), unknown)


@dataclass(frozen=True)
class _Balance:
    """sum inertia[k] udot_k + bias = load + sum forces[s] s, one component, in sympy."""

    inertia: Mapping[Any, Any]
    bias: Any
    load: Any
    forces: Mapping[Any, Any]

    def equation(self) -> Equation:
        """Return it as it is read."""
        return Equation(
            sympy.Add(*(x * a for a, x in self.inertia.items()), self.bias),
            sympy.Add(self.load, *(x * s for s, x in self.forces.items())),
        )

    def knowing(self, known: Mapping[Any, Any]) -> _Balance:
        """Return it with known reactions among the loads."""
        load = sympy.Add(self.load, *(x * known[s] for s, x in self.forces.items() if s in known))
        left = {s: x for s, x in self.forces.items() if s not in known}
        return _Balance(self.inertia, self.bias, load, left)

    @property
    def vanishing(self) -> Any:
        """The one force that the balance makes zero, None where there is more in it."""
        alone = not self.inertia and self.bias == 0 and self.load == 0 and len(self.forces) == 1
        return next(iter(self.forces)) if alone else None


class _Reactions:
    """What is found, from the leaves inward, about the reactions: `known` ones vanish or are the drives of a joint."""

    def __init__(self, motion: Motion, symbols: Symbols, names: Subexpressions) -> None:
        self.known: dict[Any, Any] = {}
        self._motion, self._symbols, self._names = motion, symbols, names
        self._slots = known_nodes(motion.mechanism, symbols)
        self._sums = _Sums(motion, symbols)

    def of_joint(self, index: int) -> Iterator[Equation]:
        """Read off what a joint transmits along its free directions, A^T R = Q; yield what names several components."""
        own = self._symbols.reactions[6 * index : 6 * index + 6]
        freedoms = [(direction, self._drive(*drive)) for direction, *drive in self._sums.drives(index)]
        if self._motion.mechanism.bodies[index].speeds_in_own_axes:
            *freedoms, x, y, z = freedoms
            axes = zip(*(self._written(direction[3:]) for direction, _ in (x, y, z)), strict=True)
            for s, row in zip(own[3:], axes, strict=True):
                self.known[s] = sympy.Add(*(a * drive for a, (_, drive) in zip(row, (x, y, z), strict=True)))
        for direction, force in freedoms:
            along = {s: x for s, x in zip(own, self._written(direction), strict=True) if x != 0 and s not in self.known}
            if len(along) == 1:
                ((s, x),) = along.items()
                self.known[s] = force / x
            elif along:
                yield Equation(sympy.Add(*(x * s for s, x in along.items())), force)

    def _drive(self, load: S, rows: Sequence[S]) -> Any:
        driven, *rates = self._written([load, *rows])
        return sympy.Add(driven, *(x * s for x, s in zip(rates, self._symbols.multipliers, strict=True)))

    def of_body(self, index: int) -> list[_Balance]:
        """Return the balances of one body that say something, and learn which reactions vanish from the others."""
        written = [self._balance(*component) for component in self._sums.components(index)]
        while True:
            balances = [balance.knowing(self.known) for balance in written]
            vanishing = {balance.vanishing for balance in balances} & set(self._symbols.reactions)
            if not vanishing:
                short = [replace(balance, load=self._names.name(balance.load)) for balance in balances]
                return [b for b in short if b.inertia or b.forces or b.bias != 0 or b.load != 0]
            self.known.update(dict.fromkeys(vanishing, sympy.S.Zero))

    def _balance(self, inertia: Mapping[Any, S], bias: S, load: S, forces: Mapping[Any, S]) -> _Balance:
        values = iter(self._written([*inertia.values(), bias, load, *forces.values()]))
        left = {a: next(values) for a in inertia}
        rest = next(values), next(values)
        right = {s: next(values) for s in forces}
        return _Balance(_non_zero(left), *rest, _non_zero(right))

    def _written(self, nodes: Sequence[S]) -> list[Any]:
        return [self._names.name(x) for x in self._names.translated(nodes, self._slots)]


def _non_zero(terms: Mapping[Any, Any]) -> dict[Any, Any]:
    return {s: x for s, x in terms.items() if x != 0}


class _Sums:
    """The terms of all balances over Nodes."""

    def __init__(self, motion: Motion, symbols: Symbols) -> None:
        self._motion, self._symbols = motion, symbols
        self._partials = partial_velocities(motion)
        self._at_rest = accelerations(motion, [0] * len(motion.state.u))
        self._loads = applied_forces(motion)
        self._rows = row_motions(motion)

    def drives(self, index: int) -> Iterator[tuple[list[S], S, list[S]]]:
        """Yield each freedom's direction A (6) in the reaction's axes, and Q of the loads and of each row."""
        body, moved = self._motion.mechanism.bodies[index], self._motion.bodies[index]
        R_FB, point = self._joint_axes(index), self._joint_point(index)
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            direction = [*apply(R_FB, add(linear, cross(angular, point))), *apply(R_FB, angular)]
            by_rows = [
                0 if row.all_told else row.forces[k] - generalized_forces(self._motion, row.of_body)[k]
                for row in self._rows
            ]
            yield direction, self._loads.of_speed[k], by_rows

    def components(self, index: int) -> Iterator[tuple[dict[Any, S], S, S, dict[Any, S]]]:
        """Yield inertia by acceleration, bias, load, and unknown forces by symbol: three of force, three of moment."""
        mass, (a, alpha) = self._motion.masses[index], self._at_rest[index]
        w = self._motion.bodies[index].w_WB
        turning = add(apply(mass.inertia, alpha), cross(w, apply(mass.inertia, w)))
        bias = scale(mass.mass, add(a, apply(spread(alpha, w), mass.com))), turning
        inertia = {
            self._symbols.accelerations[k]: (scale(mass.mass, add(v, cross(turn, mass.com))), apply(mass.inertia, turn))
            for k, (v, turn) in self._partials[index].items()
        }
        load = self._about_com(index, self._loads.of_body[index])
        forces = {**self._of_children(index), **self._of_rows(index)}
        axes, own = self._axes(index), self._own(index)
        for part in range(2):
            for i in range(3):
                axis = axes[part][i]
                yield (
                    {s: dot(axis, wrench[part]) for s, wrench in inertia.items()},
                    dot(axis, bias[part]),
                    dot(axis, load[part]),
                    {
                        **{s: wrench[part][i] for s, wrench in own.items()},
                        **{s: dot(axis, wrench[part]) for s, wrench in forces.items()},
                    },
                )

    def _axes(self, index: int) -> tuple[Mat, Mat]:
        """Return the axes of forces and of moments, as rows, in the body's axes."""
        R_FB = self._joint_axes(index)
        return R_FB, UNIT_MATRIX if self._motion.mechanism.bodies[index].speeds_in_own_axes else R_FB

    def _own(self, index: int) -> dict[Any, Wrench]:
        """Return each component of the body's own reaction, already along the axes of the balances."""
        own_axes, R_FB = self._motion.mechanism.bodies[index].speeds_in_own_axes, self._joint_axes(index)
        arm = subtract(self._joint_point(index), self._motion.masses[index].com)
        turned, units = (arm, transpose(R_FB)) if own_axes else (apply(R_FB, arm), UNIT_MATRIX)
        columns = transpose(units)
        wrenches: list[Wrench] = [(unit, cross(turned, c)) for unit, c in zip(UNIT_MATRIX, columns, strict=True)]
        return self._named(index, [*wrenches, *((ZERO_VECTOR, c) for c in columns)])

    def _of_children(self, index: int) -> dict[Any, Wrench]:
        found = {}
        for j, (child, moved) in enumerate(zip(self._motion.mechanism.bodies, self._motion.bodies, strict=True)):
            if child.parent != index:
                continue
            point = add(moved.p_PB, apply(moved.R_PB, self._joint_point(j)))
            R_BF, _ = pose(self._motion.state, child.frame_on_parent)
            directions = [negate(direction) for direction in transpose(R_BF)]
            at_point: list[Wrench] = [self._about_com(index, (d, cross(point, d))) for d in directions]
            found.update(self._named(j, [*at_point, *((ZERO_VECTOR, d) for d in directions)]))
        return found

    def _of_rows(self, index: int) -> dict[Any, Wrench]:
        pairs = zip(self._symbols.multipliers, self._rows, strict=True)
        return {s: self._about_com(index, row.of_body[index]) for s, row in pairs}

    def _named(self, index: int, wrenches: Sequence[Wrench]) -> dict[Any, Wrench]:
        first = len(COMPONENTS) * index
        return dict(zip(self._symbols.reactions[first : first + len(COMPONENTS)], wrenches, strict=True))

    def _about_com(self, index: int, wrench: Wrench) -> Wrench:
        return wrench[0], subtract(wrench[1], cross(self._motion.masses[index].com, wrench[0]))

    def _joint_axes(self, index: int) -> Mat:
        R_PF, _ = pose(self._motion.state, self._motion.mechanism.bodies[index].frame_on_parent)
        return product(transpose(R_PF), self._motion.bodies[index].R_PB)

    def _joint_point(self, index: int) -> Vec:
        return pose(self._motion.state, self._motion.mechanism.bodies[index].frame_on_body)[1]
