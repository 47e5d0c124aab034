"""What acts on each body that is cut free, one by one: its weight, declared forces, and unknown forces by symbol."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import sympy

from multibody_sym.dynamics.derivation.letters import FRICTION, Lettered
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.kinematics.loads import Applied, applied, exert, span, span_rate
from multibody_sym.kinematics.motion import Motion, accelerations, pose
from multibody_sym.kinematics.rows import RowMotion, row_motion, row_motions
from multibody_sym.kinematics.wrenches import NO_WRENCH, Wrench, Wrenches, add_pair
from multibody_sym.model.mechanism.loads import Load, PointPull, PointSpring, span_leaves
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    cross,
    negate,
    product,
    scale,
    subtract,
    transpose,
)

SPRING = "P"


@dataclass(frozen=True)
class Action:
    """What acts on one body: an unknown force by its `symbol` (None: known) and its wrench for a unit of it.

    The wrench is in body axes, about the body's origin. `kind` is weight, load, spring, reaction (counter on the
    parent), row or friction; `element` its name.
    """

    symbol: Any | None
    kind: str
    element: str
    wrench: Wrench


@dataclass(frozen=True)
class Law:
    """An unknown force that a law gives: `symbol` = `value` (a Node), or `factor` times the symbol `of`."""

    symbol: Any
    element: str
    value: S | None = None
    factor: S = 0
    of: Any | None = None


class Actions:
    """All that acts on the bodies of a motion over Nodes.

    `of_body`: by body; `laws` of friction that slides and of springs; `further` symbols with their letters; `drives`:
    what rows exert in joints, without wrenches; `of_speed` the same of loads; `contacts` the closed ones with the
    wrenches of their normal forces.
    """

    def __init__(self, motion: Motion, symbols: Symbols) -> None:
        self.motion, self.symbols = motion, symbols
        self.of_body: list[list[Action]] = [[] for _ in motion.bodies]
        self.laws: list[Law] = []
        self.further: list[Lettered] = []
        self.rows = row_motions(motion)
        self._in_joints: list[tuple[Any, Sequence[S]]] = []
        self.contacts: list[tuple[str, Sequence[Wrench]]] = []
        one_way = motion.mechanism.one_way
        self._touching = {row.name: e.group or e.name for e in one_way if e.kind == "contact" for row in e.normals}
        self._bias = accelerations(motion, [0] * len(motion.state.u))
        self._add_weight()
        known = applied(motion, [], weight=False)
        for load in motion.mechanism.loads:
            self._add_load(load, known)
        self.of_speed = known.of_speed
        self._add_reactions()
        for k, row in enumerate(motion.mechanism.rows):
            self._add_row(row, self.rows[k], symbols.multipliers[k])

    def drives(self, speed: int) -> Iterator[tuple[Any, S]]:
        """Yield what rows that act in joints exert on a speed: symbols with their factors."""
        for s, forces in self._in_joints:
            yield s, forces[speed]

    # --- what is known ---------------------------------------------------------------------------------------------

    def _add(self, symbol: Any | None, kind: str, element: str, wrenches: Sequence[Wrench]) -> None:
        for index, wrench in enumerate(wrenches):
            if wrench is not NO_WRENCH:
                self.of_body[index].append(Action(symbol, kind, element, wrench))

    def _add_weight(self) -> None:
        for index, (moved, mass) in enumerate(zip(self.motion.bodies, self.motion.masses, strict=True)):
            force = scale(mass.mass, moved.gravity)
            self.of_body[index].append(Action(None, "weight", "", (force, cross(mass.com, force))))

    def _add_load(self, load: Load, known: Applied) -> None:
        wrenches = Wrenches(len(self.motion.bodies))
        if isinstance(load, (PointSpring, PointPull)) and load.line is not None:
            length, direction = span(self.motion, load.ends)
            rate = span_rate(self.motion, load.ends, direction)
            add_pair(wrenches, self.motion, load.ends, direction)
            s = self._further(SPRING, load.name)
            self.laws.append(Law(s, load.name, value=self._pull(load, length, rate)))
            self._add(s, "spring", load.name, wrenches.of_body)
            return
        exert(load, self.motion, wrenches, known.of_speed)
        self._add(None, "load", load.name, wrenches.of_body)

    def _pull(self, load: PointSpring | PointPull, length: S, rate: S) -> S:
        state = self.motion.state
        if isinstance(load, PointSpring):
            stiffness, damping, rest = state.values([load.stiffness, load.damping, load.length])
            return stiffness * (length - rest) + damping * rate
        return state.values([load.value], dict(zip(span_leaves(load.name), (length, rate), strict=True)))[0]

    def _further(self, letter: str, element: str) -> Any:
        s = sympy.Dummy(f"{letter}_{element}", real=True)
        self.further.append(Lettered(s, letter, element))
        return s

    # --- reactions of joints -------------------------------------------------------------------------------------

    def joint_axes(self, index: int) -> Mat:
        """Return the axes of a joint's frame on the parent, as rows, in the body's axes."""
        R_PF, _ = pose(self.motion.state, self.motion.mechanism.bodies[index].frame_on_parent)
        return product(transpose(R_PF), self.motion.bodies[index].R_PB)

    def joint_point(self, index: int) -> Vec:
        """Return where a joint holds its child, in the child's axes."""
        return pose(self.motion.state, self.motion.mechanism.bodies[index].frame_on_body)[1]

    def reaction_symbols(self, index: int) -> tuple[Any, ...]:
        """Return the symbols fx .. mz of a joint's reaction."""
        return self.symbols.reactions[6 * index : 6 * index + len(COMPONENTS)]

    def _add_reactions(self) -> None:
        for index, (body, moved) in enumerate(zip(self.motion.mechanism.bodies, self.motion.bodies, strict=True)):
            axes, point = self.joint_axes(index), self.joint_point(index)
            units: list[Wrench] = [*((d, cross(point, d)) for d in axes), *((ZERO_VECTOR, d) for d in axes)]
            for s, (force, moment) in zip(self.reaction_symbols(index), units, strict=True):
                self.of_body[index].append(Action(s, "reaction", body.joint_name, (force, moment)))
                if body.parent >= 0:
                    on_parent = apply(moved.R_PB, force)
                    about = add(apply(moved.R_PB, moment), cross(moved.p_PB, on_parent))
                    back = negate(on_parent), negate(about)
                    self.of_body[body.parent].append(Action(s, "counter", body.joint_name, back))

    # --- rows ------------------------------------------------------------------------------------------------------

    def _add_row(self, row: Row, moved: RowMotion, symbol: Any) -> None:
        normal = row_motion(row.normal, self.motion, self._bias) if isinstance(row, SlidingRow) else moved
        if row.name in self._touching:
            self.contacts.append((self._touching[row.name], normal.of_body))
        self._add_unit(symbol, "row", row.name, normal.of_body, [] if normal.all_told else normal.forces)
        for sliding in row.frictions if isinstance(row, SlidingRow) else ():
            self._add_sliding(sliding, symbol, moved, normal)

    def _add_unit(self, symbol: Any, kind: str, element: str, of_body: Sequence[Wrench], forces: Sequence[S]) -> None:
        self._add(symbol, kind, element, of_body)
        if forces and all(wrench is NO_WRENCH for wrench in of_body):
            self._in_joints.append((symbol, forces))

    def _add_sliding(self, sliding: Sliding, normal: Any, moved: RowMotion, pressed: RowMotion) -> None:
        """Add friction against the motion as a force of its own, given by its law."""
        (factor,) = self.motion.state.values([sliding.coefficient])
        name = sliding.rows[0].name
        s = self._further(FRICTION, name)
        if len(sliding.rows) == 1:
            along = row_motion(sliding.rows[0], self.motion, self._bias)
            against = [_scaled(wrench, -sliding.sense) for wrench in along.of_body]
            self._add_unit(s, "friction", name, against, [-sliding.sense * x for x in along.forces])
        else:
            pairs = zip(moved.of_body, pressed.of_body, strict=True)
            self._add(s, "friction", name, [_difference(a, b, factor) for a, b in pairs])
        self.laws.append(Law(s, name, factor=factor, of=normal))


def _scaled(wrench: Wrench, factor: S) -> Wrench:
    return wrench if wrench is NO_WRENCH else (scale(factor, wrench[0]), scale(factor, wrench[1]))


def _difference(a: Wrench, b: Wrench, divisor: S) -> Wrench:
    if a is NO_WRENCH and b is NO_WRENCH:
        return NO_WRENCH
    return scale(1 / divisor, subtract(a[0], b[0])), scale(1 / divisor, subtract(a[1], b[1]))
