"""What acts on each body that is cut free, one by one: its weight, declared forces, and unknown forces by symbol."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import sympy

from multibody_sym.derivation.free_bodies import (
    FRICTION,
    MOMENT,
    SPRING,
    TENSION,
    LetteredForce,
    force_unit,
    row_elements,
)
from multibody_sym.derivation.notation import Symbols
from multibody_sym.mechanics.forces import AppliedForces, applied_forces, exert, span, span_rate
from multibody_sym.mechanics.law_elements import FrictionPart
from multibody_sym.mechanics.load_records import Load, MassFlow, PointPull, PointSpring, span_leaves
from multibody_sym.mechanics.motion import Motion, accelerations, pose
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, Wrenches, add_pair
from multibody_sym.mechanics.ropes import pull, segments, wheel_at
from multibody_sym.mechanics.row_kinematics import RowMotion, coefficients, friction_factors, row_motion, row_motions
from multibody_sym.mechanics.row_records import MeanTensionRow, ReactionRow, RopeRow, RopeSlipRow, Row, Sliding
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import tension_ratio
from multibody_sym.scalars.node import ZERO
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
from multibody_sym.text.printer import COMPONENTS

# ----------------------------------------------------------------------------------------------------------------------
# Tensions of ropes that rub on wheels, as a book has them: one on each side of a rough wheel, with belt friction.


@dataclass(frozen=True)
class RoughWheelTensions:
    """A rough wheel under a rope: the row of its `slip`, and the symbols of the tensions before and behind it."""

    slip: str
    before: Any
    behind: Any
    slides: bool


def tension_wrenches(row: RopeRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Iterator[list[Wrench]]:
    """Yield the wrenches on all bodies of a unit of each tension of a run, along its path; they act at the rims."""
    parts, _ = segments(motion, row.path, row.straight)
    rough = [k for k, bend in enumerate(row.path[1:-1], 1) if bend.rough] if row.rubs else []
    for k in rough:
        wheel = wheel_at(motion, row.path, k)
        parts[k - 1] = replace(parts[k - 1], grips=(parts[k - 1].grips[0], wheel))
        parts[k] = replace(parts[k], grips=(wheel, parts[k].grips[1]))
    cuts = [0, *rough, len(parts)]
    for first, last in pairwise(cuts):
        yield pull(motion, parts[first:last], [1] * (last - first), bias).of_body


def slipping_ratio(slip: str, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> tuple[bool, S] | None:
    """Return where a rope slips whether its tension is greater before the wheel, and how many times: exp(mu wrap).

    None where it grips. Where friction is smooth near rest the tension before it is told by that behind it.
    """
    every = (each for row in motion.mechanism.rows for each in row.sliding)
    for sliding in (each for each in every if each.rows[0].name == slip):
        along = [row_motion(row, motion, bias) for row in sliding.rows]
        (coefficient,) = friction_factors(replace(sliding, sense=-1), along, motion)
        return sliding.sense < 0 or sliding.regularised is not None, tension_ratio(coefficient)
    return None


def gripping_ratio(part: FrictionPart, motion: Motion) -> S:
    """Return how many times the less tension the greater one may be where a rope grips a wheel."""
    (static,) = coefficients(motion, part.rows, [part.static])
    return tension_ratio(static)


def is_grip(part: FrictionPart) -> bool:
    """Return whether friction is that of a rope on a rough wheel."""
    return isinstance(part.rows[0], RopeSlipRow)


# ----------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Action:
    """What acts on one body: an unknown force by its `symbol` (None: known) and its wrench for a unit of it.

    The wrench is in body axes, about the body's origin. `kind` is weight, load, flow (of mass), spring, reaction
    (counter on the parent), row or friction; `element` its name.
    """

    symbol: Any | None
    kind: str
    element: str
    wrench: Wrench


@dataclass
class ForceLaw:
    """What gives a force: the sum of factor times symbol on the `left` is that on the `right` plus `value` (Nodes)."""

    element: str
    left: list[tuple[Any, S]]
    right: list[tuple[Any, S]] = field(default_factory=list)
    value: S = 0


@dataclass(frozen=True)
class Length:
    """Friction that the length of a vector presses: `symbol` = `factor` times the length of the `normals`."""

    element: str
    symbol: Any
    factor: S
    normals: tuple[Any, ...]


class Actions:
    """All that acts on the bodies of a motion over Nodes.

    `of_body`: by body; `laws` of friction that slides and of springs, `lengths` where a vector's length presses;
    `further` symbols with their letters; `drives`: what rows exert in joints, without wrenches; `of_speed` the same of
    loads; `contacts` the closed ones with the wrenches of their normal forces; `grips` the rough wheels under ropes,
    and `tensions` what each tension of such a rope is asked by.
    """

    def __init__(self, motion: Motion, symbols: Symbols) -> None:
        self.motion, self.symbols = motion, symbols
        self.of_body: list[list[Action]] = [[] for _ in motion.bodies]
        self.laws: list[ForceLaw] = []
        self.lengths: list[Length] = []
        self.further: list[LetteredForce] = []
        self.rows = row_motions(motion)
        self._in_joints: list[tuple[Any, Sequence[S]]] = []
        self.contacts: list[tuple[str, Sequence[Wrench]]] = []
        self.grips: list[RoughWheelTensions] = []
        self.tensions: dict[Any, str] = {}
        # ropes that rub on wheels: their runs have a tension each, and one more for each rough wheel
        runs = (row.plain.rope_run for row in motion.mechanism.rows)
        self._rubbing_ropes = {run.told[0] for run in runs if run is not None and run.rubs}
        one_way = motion.mechanism.one_way
        self._elements = row_elements(motion.mechanism)
        self._touching = {row.name for each in one_way if each.kind == "contact" for row in each.normals}
        self._rubbing: dict[str, ForceLaw] = {}
        self.bias = accelerations(motion, [0] * len(motion.state.u))
        self._add_weight()
        known = applied_forces(motion, [], weight=False)
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

    def _add_load(self, load: Load, known: AppliedForces) -> None:
        wrenches = Wrenches(len(self.motion.bodies))
        if isinstance(load, (PointSpring, PointPull)) and load.line is not None:
            length, direction = span(self.motion, load.ends)
            rate = span_rate(self.motion, load.ends, direction)
            add_pair(wrenches, self.motion, load.ends, direction)
            s = self._further(SPRING, load.name)
            self.laws.append(ForceLaw(load.name, [(s, 1)], value=self._pull(load, length, rate)))
            self._add(s, "spring", load.name, wrenches.of_body)
            return
        exert(load, self.motion, wrenches, known.of_speed)
        self._add(None, "flow" if isinstance(load, MassFlow) else "load", load.name, wrenches.of_body)

    def _pull(self, load: PointSpring | PointPull, length: S, rate: S) -> S:
        state = self.motion.state
        if isinstance(load, PointSpring):
            stiffness, damping, rest = state.values([load.stiffness, load.damping, load.length])
            return stiffness * (length - rest) + damping * rate
        return state.values([load.value], dict(zip(span_leaves(load.name), (length, rate), strict=True)))[0]

    def _further(self, letter: str, element: str, own: str = "") -> Any:
        s = sympy.Dummy(f"{letter}_{element}", real=True)
        self.further.append(LetteredForce(s, letter, self.element(element), own))
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

    def element(self, row: str) -> str:
        """Return the declared element, or the part of a contact, that a row belongs to."""
        return self._elements.get(row, row)

    @cached_property
    def told(self) -> dict[Any, str]:
        """The name of the element of each force that is no reaction."""
        rows = zip(self.symbols.multipliers, self.motion.mechanism.rows, strict=True)
        told = {s: self.element(row.name) if row.rope_run is None else row.rope_run.told[0] for s, row in rows}
        return {**told, **{each.symbol: each.element for each in self.further}}

    def _add_row(self, row: Row, moved: RowMotion, symbol: Any) -> None:
        normal = row.plain
        run = normal.rope_run
        if run is not None and run.told[0] in self._rubbing_ropes:
            self._add_tensions(run)
            return
        if isinstance(normal, (RopeSlipRow, MeanTensionRow)):  # told by the tensions on both sides of the wheel
            return
        name = self.element(row.name) if run is None else run.told[0]
        if isinstance(normal, ReactionRow):
            self.laws.append(self._pressing(normal, symbol))
        else:
            bare = moved if normal is row else row_motion(normal, self.motion, self.bias)
            self._add_unit(symbol, "row", name, bare.of_body, [] if bare.all_told else bare.forces)
            if row.name in self._touching:
                self.contacts.append((name, bare.of_body))
        for sliding in row.sliding:
            self._add_sliding(sliding, symbol, moved, normal)

    def _add_tensions(self, rope: RopeRow) -> None:
        """Add each tension of a run of rope that rubs on wheels, or of another run of it, and the laws of belts."""
        name = rope.told[0]
        of_each = zip(rope.asked, tension_wrenches(rope, self.motion, self.bias), strict=True)
        found = []
        for k, (asked, of_body) in enumerate(of_each):
            s = self._further(TENSION, name, own=f"{rope.label}{rope.run + k}" if rope.label else "")
            self.tensions[s] = asked
            self._add(s, "row", name, of_body)
            found.append(s)
        for slip, before, behind in zip(rope.rubs, found, found[1:], strict=False):
            ratio = slipping_ratio(slip, self.motion, self.bias)
            self.grips.append(RoughWheelTensions(slip, before, behind, slides=ratio is not None))
            if ratio is not None:
                greater, less = (before, behind) if ratio[0] else (behind, before)
                self.laws.append(ForceLaw(self.element(slip), [(greater, 1)], [(less, ratio[1])]))

    def _add_unit(self, symbol: Any, kind: str, element: str, of_body: Sequence[Wrench], forces: Sequence[S]) -> None:
        self._add(symbol, kind, element, of_body)
        if forces and all(wrench is NO_WRENCH for wrench in of_body):
            self._in_joints.append((symbol, forces))

    def _add_sliding(self, sliding: Sliding, normal: Any, moved: RowMotion, pressing: Row) -> None:
        """Add friction against the motion as a force of its own, given by its law; several normals make one force."""
        name = sliding.rows[0].name
        along = [row_motion(row, self.motion, self.bias) for row in sliding.rows]
        factors = friction_factors(sliding, along, self.motion)
        (size,) = [-sliding.sense * factors[0]] if len(along) == 1 else self.motion.state.values([sliding.coefficient])
        if name in self._rubbing:
            if not sliding.beside:
                self._rubbing[name].right.append((normal, size))
            return
        unit = force_unit(sliding.rows[0], self.motion.mechanism)
        s = self._further(MOMENT if unit == "N*m" else FRICTION, name)
        self._rubbing[name] = ForceLaw(self.element(name), [(s, 1)], [(normal, size)])
        if sliding.beside:
            places = [row.name for row in self.motion.mechanism.rows]
            others = (self.symbols.multipliers[places.index(other)] for other in sliding.beside)
            self.lengths.append(Length(self.element(name), s, size, (normal, *others)))
        else:
            self.laws.append(self._rubbing[name])
        if len(along) == 1:
            against = [
                x if x is NO_WRENCH else (scale(-sliding.sense, x[0]), scale(-sliding.sense, x[1]))
                for x in along[0].of_body
            ]
            self._add_unit(s, "friction", self.element(name), against, [-sliding.sense * x for x in along[0].forces])
        else:
            pressed = row_motion(pressing, self.motion, self.bias)
            in_joint = all(wrench is NO_WRENCH for row in along for wrench in row.of_body)
            against = [
                NO_WRENCH
                if in_joint or (a is NO_WRENCH and b is NO_WRENCH)
                else (scale(1 / size, subtract(a[0], b[0])), scale(1 / size, subtract(a[1], b[1])))
                for a, b in zip(moved.of_body, pressed.of_body, strict=True)
            ]
            forces = [(a - b) / size for a, b in zip(moved.forces, pressed.forces, strict=True)]
            self._add_unit(s, "friction", self.element(name), against, forces)

    def _pressing(self, row: ReactionRow, symbol: Any) -> ForceLaw:
        """Return what a row that defines a part of a joint's reaction, or a constant, says."""
        if row.constant is not ZERO:
            return self._defined(row, symbol)
        share, rubbing, *parts = self.motion.state.values([row.share, row.rubbing, *row.force, *row.moment])
        names = [row.name for row in self.motion.mechanism.rows]
        left = [(symbol, share)]
        left += [(self.symbols.multipliers[names.index(row.rubs)], rubbing)] if row.rubs in names else []
        for index, body in enumerate(self.motion.mechanism.bodies):
            if body.joint_name == row.joint:
                right = list(zip(self.reaction_symbols(index), parts, strict=True))
                return ForceLaw(self.element(row.name), left, right)
        return self._defined(row, symbol)

    def _defined(self, row: Row, symbol: Any) -> ForceLaw:
        k = [other.name for other in self.motion.mechanism.rows].index(row.name)
        found = self.rows[k]
        right = [(self.symbols.multipliers[j], x) for j, x in found.coupling.items() if j != k]
        moving = list(zip(self.symbols.accelerations, found.jacobian, strict=True))
        return ForceLaw(self.element(row.name), [(symbol, -found.coupling[k])], [*moving, *right], -found.gamma)
