"""What acts at an instant by element and component: of a solution, and of the end of a run."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from multibody_sym.answers.records import Solution
from multibody_sym.derivation.free_bodies import (
    FRICTION,
    MOMENT,
    NORMAL,
    SPRING,
    TENSION,
    LetteredForce,
    component_label,
    force_unit,
    guide_normal,
    own_letter,
    row_letter,
    spell_forces,
)
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.reactions import LawForces, ropes
from multibody_sym.dynamics.redundancy import idle_combinations
from multibody_sym.mechanics.contact_geometry import touch
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.law_elements import PRESSING, FrictionPart, LawElement, component_names
from multibody_sym.mechanics.load_records import JointForce, JointSpring, LineLoad, Load, PointPull, PointSpring
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, accelerations, motion_of, state_of
from multibody_sym.mechanics.points import NO_WRENCH, Wrench
from multibody_sym.mechanics.row_kinematics import coefficients, row_motion
from multibody_sym.mechanics.row_records import RopeRow, Row
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.bodies import GROUND, mass_of
from multibody_sym.model.joints import Joint
from multibody_sym.model.parameters import in_letters
from multibody_sym.model.system import System
from multibody_sym.pictures.marks.forces import FrictionCone
from multibody_sym.pictures.scene.forces import letter_of
from multibody_sym.pictures.scene.items import Anchor, ArrowItem, Placed, PlacedStrand, vector
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.pictures.scene.stage import PlacedSystem
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.pivoted_qr import NEGLIGIBLE
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.vectors import S, Vec
from multibody_sym.text.printer import COMPONENTS, text

if TYPE_CHECKING:
    from multibody_sym.motion.results.trajectory import Trajectory


# ----------------------------------------------------------------------------------------------------------------------
# Records of bodies cut free: what pulls at them.


Body = int
Key = tuple[str, ...]
"""What a force is: weight, load, joint with its component, tension, row."""
Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class ForceArrow:
    """A force or couple (`turns`) on a body at a place: `value` times `way` (world), which is the way of its letter.

    `path` is where it is declared. `both`: a figure of the whole has it at both ends, as it has pulls of ropes. `open`:
    it is not unique; its value is one of those that are possible, or unknown (nan).
    """

    key: Key
    path: tuple[str, ...]
    at: Anchor
    way: Floats
    value: float
    turns: bool = False
    both: bool = False
    open: bool = False

    @property
    def vector(self) -> Floats:
        """The force or couple (world)."""
        return self.value * self.way

    @property
    def size(self) -> float:
        """Its size in N or N*m."""
        return float(np.linalg.norm(self.vector))

    @property
    def is_applied(self) -> bool:
        """Whether it is a weight or a declared force, no reaction."""
        return self.key[0] in ("weight", "load", "drive")


# ----------------------------------------------------------------------------------------------------------------------
# Forces of contacts and stops that are not unique at an instant, and sums of friction that are.


Component = tuple[str, str]
"""An element and a component of its force."""


def open_forces(motion: Motion, ambiguous: Collection[str]) -> frozenset[Component]:
    """Return the components whose rows are among those that are ambiguous, friction also by what presses."""
    found: set[Component] = set()
    acting = {row.name for row in motion.mechanism.rows}
    for element in motion.mechanism.one_way:
        if element.kind not in ("contact", "stop"):
            continue
        pressed = element.normals[0].name in ambiguous
        found |= {(element.name, PRESSING[element.kind])} if pressed else set()
        for part in (part for part in element.frictions if part.rubs):
            names = component_names(element, part)
            for name, row in zip(names, part.rows, strict=True):
                if row.name in ambiguous or (pressed and row.name not in acting):
                    found.add((element.name, name))
    return frozenset(found)


def sums(instant: StateQuantities, several: Collection[Component], touching: Motion) -> Values:
    """Return by contact the friction of all its corners together, where that is unique and single ones are not.

    `touching` is the motion of the mechanism with the rows of all that touches and sticks.
    """
    mechanism = instant.motion.mechanism
    groups = {e.group: [x for x in mechanism.one_way if x.group == e.group] for e in mechanism.one_way}
    asked = {
        name: corners
        for name, corners in groups.items()
        if len(corners) > 1 and any((corner.name, "friction") in several for corner in corners)
    }
    if not asked:
        return {}
    dynamics = composite_body(touching.mechanism, touching.state)
    names, idle = dynamics.row_names, idle_combinations(dynamics)
    acting = LawForces(instant.motion, instant.multipliers)
    found = {}
    for name, corners in asked.items():
        rubbing = (part for x in corners if (x.name, "friction") in several for part in x.frictions[:1])
        rows = {row.name for part in rubbing for row in part.rows}
        left = (sum(share for row, share in zip(names, each, strict=True) if row in rows) for each in idle)
        if rows <= set(names) and all(abs(float(x)) <= NEGLIGIBLE for x in left):
            found[name] = {"friction": float(acting.component(name, "friction"))}
    return found


# ----------------------------------------------------------------------------------------------------------------------

def at_start(solution: Solution) -> tuple[Values, frozenset[str], frozenset[Component]]:
    """Return the reactions of a solution (nan where one has no value), what slides, and what is not unique."""
    values = {
        name: {part: np.nan if x.value is None else float(x.value) for part, x in parts.items()}
        for name, parts in solution.reactions.items()
    }
    sliding = frozenset(name for name, word in solution.states.items() if word.startswith("slide"))
    return values, sliding, open_of(solution)


def open_of(solution: Solution) -> frozenset[Component]:
    """Return the elements and components of a solution that are not unique."""
    reactions = solution.reactions.items()
    return frozenset((name, part) for name, parts in reactions for part, x in parts.items() if not x.unique)


def at_end(run: Trajectory) -> tuple[Values, frozenset[str], frozenset[Component]]:
    """Return what acts at the end of a run, what slides there, and what of contacts and stops is not unique.

    Where the friction of a contact's corners is not, and their sum is, this is among the values.
    """
    from multibody_sym.motion.results.samples import last_part

    part = last_part(run)
    q, u, inputs = (part.arguments[k][-1].tolist() for k in (1, 2, 4))
    known = state_of(part.mechanism, float, float(part.t[-1]), q, u, part.parameters.tolist(), inputs)
    _, udot, multipliers, *_ = part.derivative
    instant = StateQuantities(motion_of(part.mechanism, known), udot[-1].tolist(), multipliers[-1].tolist())
    mode = part.mechanism.mode
    sliding = frozenset(name for name, slip in (mode.slips.items() if mode else ()) if slip)
    several = open_forces(instant.motion, run.redundancy.ambiguous)
    values = _values(run, instant)
    if several:
        told = run.ready.told.mechanism
        begin = state_of(told, float, float(run.problem.t0), run.q[0], run.u[0], part.parameters.tolist())
        values |= sums(instant, several, motion_of(told, begin))
    return values, sliding, several


def _values(run: Trajectory, instant: StateQuantities) -> dict[str, Mapping[str, float]]:
    """Return the forces at an instant but ambiguous ones; those of joints are what the run tells of them."""
    mechanism, several = instant.motion.mechanism, run.redundancy.ambiguous
    acting = LawForces(instant.motion, instant.multipliers)
    found: dict[str, dict[str, Any]] = {
        row.name: {"force": x}
        for row, x in zip(mechanism.rows, instant.multipliers, strict=True)
        if row.name.rpartition(".")[0] not in mechanism.joint_names
    }
    found |= {name: {c: x[-1] for c, x in parts.items()} for name, parts in run.reactions.items()}
    for row in ropes(mechanism):
        found.setdefault(row.told[0], {}).pop("force", None)
        tensions = zip(row.components, (instant.tensions[asked] for asked in row.asked), strict=True)
        found[row.told[0]] |= dict(tensions)
    for element in mechanism.one_way:
        if element.normals[0].rope_run is None:
            found[element.name] = acting.of(element)
    kept: dict[str, Mapping[str, float]] = {}
    for name, parts in found.items():
        ambiguous = several.get(name)  # no components: the element as a whole
        left = [c for c in parts if ambiguous is None or (ambiguous and c not in ambiguous)]
        kept[name] = {c: float(parts[c]) for c in left}
    return kept


# ----------------------------------------------------------------------------------------------------------------------
# What joints exert, component by component: reactions across their freedoms, drives and friction along these.


_ALONG: Final = 1.0 - 1e-9


@dataclass(frozen=True)
class JointForces:
    """The components of joints' forces of a mechanism, whose `stage` has the numbers of what is declared.

    `rows` are the constraints that act on freedoms of joints alone, with the generalised force of each.
    """

    mechanism: Mechanism
    stage: PlacedSystem
    rows: Mapping[str, Sequence[S]]

    def keys(self, name: str) -> Iterator[tuple[str, Key]]:
        """Yield each component fx .. mz of a joint with what it is: its reaction, or what acts along a freedom."""
        free = self._free(self.stage.system.joints[name])
        acting = list(self._acting(name)) if free else []
        for component in COMPONENTS:
            along = component in free
            yield component, acting[0] if along and len(acting) == 1 else ("joint", name, component)

    def _free(self, joint: Joint) -> set[str]:
        """Return the components along the freedoms of a joint, as far as these keep to the axes of its frame."""
        found = set()
        turns = [axis for step in joint.steps for axis in step.turns]
        for step in joint.steps:
            for letter, axes in (("f", step.slides), ("m", step.turns if len(turns) in (1, 3) else ())):
                for axis in axes:
                    ways = np.abs(self.stage.vector(axis))
                    k = int(np.argmax(ways))
                    if ways[k] >= _ALONG * float(np.linalg.norm(ways)):
                        found.add(f"{letter}{'xyz'[k]}")
        return found

    def _acting(self, name: str) -> Iterator[Key]:
        """Yield what acts along the freedoms of a joint: loads, friction, stops, constraints on its coordinates."""
        for load in self.mechanism.loads:
            if isinstance(load, (JointForce, JointSpring)) and load.joint == name:
                yield "drive", load.name
        for element in self.mechanism.one_way:
            if element.joint == name:
                rows = [row for part in element.frictions for row in part.rows] or list(element.normals)
                yield from (("row", row.name) for row in rows)
        if self.rows:
            speeds = [k for body in self.mechanism.bodies if body.joint_name == name for k in body.u]
            yield from (("row", row) for row, forces in self.rows.items() if any(float(forces[k]) for k in speeds))


def shown_components(scene: Scene) -> Callable[[bool, Floats], bool]:
    """Return whether a component is seen: in a plane mechanism forces in the plane and couples across it alone.

    What redundant constraints leave open is among the others.
    """
    towards = np.asarray(scene.view.towards)

    def seen(turns: bool, axis: Floats) -> bool:
        across = abs(float(towards @ axis))
        return not scene.plane or abs(across - (0.0 if turns else 1.0)) > 1.0 - _ALONG

    return seen


# ----------------------------------------------------------------------------------------------------------------------
# What pulls at bodies that are cut free: weights, loads, joints, ropes, rods, contacts and friction, one by one.


_NONE: Final = np.zeros(3)


@dataclass(frozen=True, eq=False)
class CutFree:
    """A system whose bodies are cut free of each other at an instant of a `motion`.

    `values` are what acts there, by element and component: those of a `Solution` or of a run; nan where it is unknown.
    `sliding` are the elements that slide, `open` the elements and components that are not unique, though they may
    have a possible value.
    """

    system: System
    scene: Scene
    motion: Motion
    values: Values
    sliding: Collection[str] = ()
    open: Collection[tuple[str, str]] = ()

    @cached_property
    def placed(self) -> Placed:
        """The scene at the instant."""
        return self.scene.placed(self.motion)

    @cached_property
    def ground(self) -> frozenset[int]:
        """The numbers of ground: that of the world, and of a ground that moves."""
        return frozenset({-1, *(k for k, name in enumerate(self.scene.bodies) if name == GROUND)})

    @cached_property
    def stage(self) -> PlacedSystem:
        """The numbers of what is declared."""
        return PlacedSystem(self.system, self.scene.mechanism, self.scene.begin)

    def pulls(self) -> Iterator[ForceArrow]:
        """Yield all forces and couples on all bodies; what acts between two is there for both, the child first."""
        yield from self._weights()
        for load in self.scene.mechanism.loads:
            if not isinstance(load, (JointForce, JointSpring)):  # what joints hold them with has them
                yield from self._load(load)
        yield from self._joints()
        for placed in self.placed.strands:
            if placed.strand.rope is not None:
                yield from self._rope(placed, placed.strand.rope)
        yield from self._rows()

    def lasting(self) -> Iterator[Key]:
        """Yield the rows that act now, though their force may be zero or unknown; open contacts have zeros alone."""
        yield from (("row", row.name) for row in self.scene.mechanism.rows)
        for element in self.scene.mechanism.one_way:
            acts = any(value != 0.0 for value in self.values.get(element.name, {}).values())
            if acts and element.name not in self.sliding:
                yield from (("row", row.name) for row in element.rows)

    def _value(self, element: str, component: str) -> float:
        return float(self.values.get(element, {}).get(component, np.nan))

    # --- what is applied -------------------------------------------------------------------------------------------

    def _weights(self) -> Iterator[ForceArrow]:
        gravity = np.asarray(self.scene.gravity)
        for k, mass in enumerate(self.motion.masses):
            name = self.scene.mechanism.bodies[k].name
            at = np.array([float(x) for x in mass.com])
            yield from self._arrow(("weight", name), ("bodies", name), k, float(mass.mass) * gravity, at, 1.0)

    def _load(self, load: Load) -> Iterator[ForceArrow]:
        wrenches = applied_forces(self.motion, [load], weight=False).of_body
        points = () if isinstance(load, LineLoad) else load.points  # the line of its resultant passes neither end
        values = self.motion.state.values
        places = {m.body: np.array([float(x) for x in values(list(m.pose.position))]) for m in points}
        for k, wrench in enumerate(wrenches):
            yield from self._wrench(("load", load.name), load.path, k, wrench, 1.0, places.get(k))

    # --- joints ----------------------------------------------------------------------------------------------------

    def _joints(self) -> Iterator[ForceArrow]:
        for name, joint in self.system.joints.items():
            if name not in self.values:
                continue
            parent, child = self.stage.place(joint.parent), self.stage.place(joint.child)
            axes = self.placed.poses[parent.body][:, :3] @ parent.rotation
            where = self.placed.world(child.body, np.array([child.point]))[0]
            for key, turns, way, value in self._transmitted(name, axes):
                for body, sign in ((child.body, 1.0), (parent.body, -1.0)):
                    at = self._within(body, where)
                    yield from self._arrow(key, ("joints", name), body, sign * way, at, value, turns=turns)

    def _transmitted(self, name: str, axes: Floats) -> Iterator[tuple[Key, bool, Floats, float]]:
        """Yield what a joint transmits: what it is, whether a couple, its way and value; a constraint's all at once."""
        seen = shown_components(self.scene)
        held: dict[tuple[str, bool], Floats] = {}
        for component, key in JointForces(self.scene.mechanism, self.stage, self._in_joints).keys(name):
            value, turns = self._value(name, component), component[0] == "m"
            axis = axes[:, "xyz".index(component[1])]
            if not np.isfinite(value) or not seen(turns, axis):
                continue
            if key[0] == "row" and key[1] in self._in_joints:
                held[key[1], turns] = held.get((key[1], turns), _NONE) + value * axis
            else:
                yield key, turns, axis, value
        for (row, turns), total in held.items():
            value = self._multiplier(row)
            if value:
                yield ("row", row), turns, total / value, value

    @cached_property
    def _in_joints(self) -> Mapping[str, Sequence[S]]:
        """What constraints exert on each speed for a multiplier of 1, where they act on joints' freedoms alone."""
        found = {}
        one_way = {row.name for element in self.scene.mechanism.one_way for row in element.rows}
        for row in self.scene.mechanism.rows:
            if row.name not in one_way and np.isfinite(self._multiplier(row.name)):
                moved = row_motion(row, self.motion, self._bias)
                if not moved.all_told and all(wrench is NO_WRENCH for wrench in moved.of_body):
                    found[row.name] = moved.forces
        return found

    def _multiplier(self, row: str) -> float:
        """Return the one value that is told of a constraint, nan where there is none."""
        told = list(self.values.get(row, {}).values())
        return float(told[0]) if len(told) == 1 else float("nan")

    # --- ropes -----------------------------------------------------------------------------------------------------

    def _rope(self, placed: PlacedStrand, number: int) -> Iterator[ForceArrow]:
        runs = self.scene.ropes[number]
        bends = [bend for k, run in enumerate(runs) for bend in run.path[bool(k) :]]
        tensions = list(self._tensions(placed.strand.name, runs))
        if len(placed.pieces) != len(bends) - 1 or len(tensions) != len(placed.pieces):
            return
        for k, (start, end) in enumerate(placed.pieces):
            key, tension = tensions[k]
            way = (end - start) / (np.linalg.norm(end - start) or 1.0)
            for bend, place, sign in ((bends[k], start, 1.0), (bends[k + 1], end, -1.0)):
                at = self._within(bend.at.body, place)
                yield from self._arrow(key, placed.strand.path, bend.at.body, sign * way, at, tension, both=True)

    def _tensions(self, name: str, runs: Sequence[RopeRow]) -> Iterator[tuple[Key, float]]:
        """Yield the tension of each straight piece of a rope with what it is asked by."""
        told = [(part, value) for part, value in self.values.get(name, {}).items() if part.startswith("tension")]
        k = 0
        for run in runs:
            rough = [j for j, bend in enumerate(run.path[1:-1], 1) if bend.rough] if run.rubs else []
            for piece in range(len(run.path) - 1):
                at = k + sum(j <= piece for j in rough)
                if at >= len(told) or not np.isfinite(told[at][1]):
                    return
                yield ("tension", run.asked[at - k]), float(told[at][1])
            k += 1 + len(rough)

    # --- rows ------------------------------------------------------------------------------------------------------

    def _rows(self) -> Iterator[ForceArrow]:
        """Yield the forces of rows but ropes' and joints': rods, contacts, stops, friction."""
        names = {*self.system.joints, *self.system.contacts}
        for row in self.scene.mechanism.rows:
            told = [float(x) for x in self.values.get(row.name, {}).values()]
            if len(told) == 1 and row.name not in names and row.rope_run is None:
                places = None if row.surfaces is None else self._touched([row])
                yield from self._exerted(row, told[0], ("row", row.name), ("constraints", row.name), places)
        for element in self.scene.mechanism.one_way:
            if element.kind in ("contact", "stop"):
                yield from self._of_element(element)

    def _of_element(self, element: LawElement) -> Iterator[ForceArrow]:
        places = self._touched(list(element.rows))
        if element.unilateral:
            row = element.normals[0]
            component = "normal" if element.kind == "contact" else "force"
            yield from self._single(element, row, component, places)
        for part in element.frictions:
            yield from self._friction(element, part, places)

    def _friction(self, element: LawElement, part: FrictionPart, places: Mapping[Body, Floats]) -> Iterator[ForceArrow]:
        """Yield friction along one row as the equations have it; in space both parts together, as a force."""
        several, words = len(part.rows) > 1, component_names(element, part)
        total = self._value(element.group, words[0])
        known = [np.isfinite(self._value(element.name, each)) for each in words]
        is_open = not all(known) or any((element.name, each) in self.open for each in words)
        if is_open and element.group != element.name and np.isfinite(total) and not several:
            yield from self._together(element, part, total)
            return
        for row, each in zip(part.rows, words, strict=True):
            yield from self._single(element, row, each, places, element.name)

    def _single(
        self, element: LawElement, row: Row, component: str, places: Mapping[Body, Floats], slides: str = ""
    ) -> Iterator[ForceArrow]:
        """Yield the force of one row, of one that is open without a value by its way."""
        value, is_open = self._value(element.name, component), (element.name, component) in self.open
        known = 1.0 if is_open and not np.isfinite(value) else value
        for pull in self._exerted(row, known, ("row", row.name), element.path, places, slides=slides):
            yield replace(pull, value=pull.value if np.isfinite(value) else value, open=True) if is_open else pull

    def _together(self, element: LawElement, part: FrictionPart, total: float) -> Iterator[ForceArrow]:
        """Yield the friction of all corners of a contact, where only that is determined, once: where they press."""
        corners = [each for each in self.scene.mechanism.one_way if each.group == element.group]
        if corners[0] is not element:
            return
        at = np.array([self._value(element.group, f"at_{axis}") for axis in "xyz"])
        places = {k: self._within(k, at) for k in range(len(self.motion.bodies))} if np.isfinite(at).all() else None
        yield from self._exerted(part.rows[0], total, ("friction", element.group), element.path, places)

    def cones(self) -> Iterator[FrictionCone]:
        """Yield the cones of friction of contacts that stick, on each body that they press; in space there are none."""
        for element in self.scene.mechanism.one_way:
            parts = [part for part in element.frictions if len(part.rows) == 1]
            pressed = element.kind == "contact" and self._value(element.name, "normal") > 0.0
            if not pressed or not parts or parts[0].enough or element.name in self.sliding:
                continue
            places = self._touched(list(element.rows))
            (coefficient,) = coefficients(self.motion, parts[0].rows, [parts[0].static])
            for k, (force, _) in enumerate(self._unit(element.normals[0])):
                if k in places and k not in self.ground and any(force):
                    at, normal = Anchor(k, vector(places[k])), vector(np.array(force, dtype=float))
                    yield FrictionCone(element.group, at, normal, float(coefficient))

    def _touched(self, rows: Sequence[Row]) -> dict[Body, Floats]:
        """Return for each body where an element touches it, or the lines of all its forces meet (body axes)."""
        found: dict[Body, Floats] = {}
        if rows[0].surfaces is not None:
            where = np.array(touch(rows[0].surfaces, self.motion, self._bias).place, dtype=float)
            return {k: self._within(k, where) for k in range(len(self.motion.bodies))}
        each = [self._unit(row) for row in rows]
        for k in range(len(self.motion.bodies)):
            forces = [(np.array(f, dtype=float), np.array(m, dtype=float)) for f, m in (one[k] for one in each)]
            forces = [(f, m) for f, m in forces if np.linalg.norm(f) > 0.0]
            if forces:
                matrix = np.vstack([[[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]] for (x, y, z), _ in forces])  # r x f
                found[k] = least_squares(matrix, np.concatenate([m for _, m in forces]))
        return found

    @cached_property
    def _bias(self) -> Sequence[tuple[Vec, Vec]]:
        return accelerations(self.motion, [0] * len(self.motion.state.u))

    def _unit(self, row: Row) -> Sequence[Wrench]:
        return row_motion(row, self.motion, self._bias).of_body

    def _exerted(
        self, row: Row, value: float, key: Key, path: tuple[str, ...], places: Mapping[Body, Floats] | None,
        slides: str = "",
    ) -> Iterator[ForceArrow]:  # fmt: skip
        """Yield a row's force on each body; what slides points as it acts, since its letter is never negative."""
        if not np.isfinite(value):
            return
        turned = -1.0 if value < 0.0 and slides in self.sliding else 1.0
        for k, wrench in enumerate(self._unit(row)):
            place = None if places is None else places.get(k)
            force, moment = (turned * np.array([float(x) for x in part]) for part in wrench)
            yield from self._wrench(key, path, k, (vector(force), vector(moment)), turned * value, place)

    # --- arrows ----------------------------------------------------------------------------------------------------

    def _wrench(
        self, key: Key, path: tuple[str, ...], body: Body, wrench: Wrench, value: float, place: Floats | None
    ) -> Iterator[ForceArrow]:
        """Yield a wrench (body axes, about its origin) as a force at a place, and as a couple what is left there."""
        force, moment = (np.array([float(x) for x in part]) for part in wrench)
        if place is None and force.any():
            place = np.cross(force, moment) / float(force @ force)
        at = _NONE if place is None else place
        turned = self.placed.poses[body][:, :3]
        couple = moment - np.cross(at, force)
        if np.linalg.norm(couple) <= 1e-9 * (np.linalg.norm(moment) + np.linalg.norm(at) * np.linalg.norm(force)):
            couple = _NONE
        yield from self._arrow(key, path, body, turned @ force, at, value)
        yield from self._arrow(key, path, body, turned @ couple, at, value, turns=True)

    def _arrow(
        self, key: Key, path: tuple[str, ...], body: Body, way: Floats, at: Floats, value: float, **kind: bool
    ) -> Iterator[ForceArrow]:
        if way.any():
            yield ForceArrow(key, path, Anchor(body, vector(at)), way, value, **kind)

    def _within(self, body: Body, place: Floats) -> Floats:
        pose = self.placed.poses[body]
        found: Floats = pose[:, :3].T @ (place - pose[:, 3])
        return found


# ----------------------------------------------------------------------------------------------------------------------
# The letters of forces on bodies that are cut free: those that the equations of the same bodies have.


def force_names(system: System, mechanism: Mechanism, acting: Collection[Key]) -> Mapping[Key, str]:
    """Return the letter of each of the forces that act, as `solve --steps` has it: T, N1, F, A_x, M_A.

    What is zero just now acts too, so that the numbers of letters do not change with time. Weights are m*g where that
    is short, declared forces have the letter of their value, else their name; multipliers without a letter lambda_name.
    """
    guides = {key for key in map(_guide, mechanism.bodies) if key and key[1] not in system.joints}  # a moving ground's
    lettered = [each for each in _letters_of_forces(mechanism) if each.symbol in guides.union(acting)]
    joints = {key: component_label(*key[1:]) for key in acting if key[0] == "joint"}
    found = {key: label.text for key, label in spell_forces(mechanism, lettered, joints).items()}
    book = letters_of(system)
    return {key: found.get(key) or in_letters(_own_name(system, key), book) for key in acting}


def _letters_of_forces(mechanism: Mechanism) -> Iterator[LetteredForce]:
    """Yield all forces of rows, joints that guide, springs and ropes, in the order of the equations."""
    one_way = {row.name for element in mechanism.one_way for row in element.rows}
    smooth = {
        row.name: LetteredForce(("tension", row.asked[0]), TENSION, row.told[0], own_letter(row))
        for row in ropes(mechanism)
        if not row.rubs
    }
    for row in mechanism.rows:
        letter = row_letter(row, mechanism)
        if not letter or row.name in one_way:
            continue
        if row.rope_run is None:
            yield LetteredForce(("row", row.name), letter, row.name)
        elif not row.rope_run.rubs:
            yield smooth[row.name]
    for body in mechanism.bodies:
        guide = _guide(body)
        if guide:
            yield LetteredForce(guide, NORMAL, body.joint_name)
    for load in mechanism.loads:
        if isinstance(load, (PointSpring, PointPull)) and load.line is not None:
            yield LetteredForce(("load", load.name), SPRING, load.name)
    for row in (row for row in ropes(mechanism) if row.rubs):
        for k, asked in enumerate(row.asked):
            own = f"{row.label}{row.run + k}" if row.label else ""
            yield LetteredForce(("tension", asked), TENSION, row.told[0], own)
    for element in mechanism.one_way:
        row = element.normals[0]
        if row.rope_run is not None:
            if not row.rope_run.rubs:
                yield smooth[row.name]
        elif element.unilateral:
            yield LetteredForce(("row", row.name), NORMAL, element.name)
        for part in (part for part in element.frictions if part.rubs):
            for each in part.rows:
                letter = MOMENT if force_unit(each, mechanism) == "N*m" else FRICTION
                yield LetteredForce(("row", each.name), letter, part.name)


def _guide(body: TreeBody) -> Key:
    """Return what the normal force of a joint that slides in the plane is, nothing for other joints."""
    across = guide_normal(body)
    return () if across is None else ("joint", body.joint_name, COMPONENTS[across])


def _own_name(system: System, key: Key) -> str:
    """Return the name of a force that the equations have no letter for; of a weight m*g where both are letters."""
    kind, name = key[0], key[1]
    if kind == "weight":
        given: list[Any] = [node for node in system.gravity if node.shadow != 0]
        mass = text(mass_of(system.bodies[name]).mass) if name in system.bodies else ""
        g = text(given[0]).removeprefix("-") if len(given) == 1 else ""
        is_short = g.isidentifier() and all(each.isidentifier() for each in mass.split("*"))
        return f"{mass}*{g}" if is_short else f"G_{name}"
    if kind == "friction":
        return f"{FRICTION}_{name}"
    if kind in ("load", "drive"):
        return letter_of(name, getattr(system.forces.get(name), "value", ()))
    return f"lambda_{re.sub(r'[^A-Za-z0-9_]+', '_', name)}" if kind == "row" else name


# ----------------------------------------------------------------------------------------------------------------------
# Arrows of what pulls at bodies: those of a body cut free, and those of a figure of the whole mechanism.


_NEGLIGIBLE: Final = 1e-9
"""Forces below this part of the largest are zero but for rounding, and have no direction."""


def all_arrows(cut: CutFree) -> list[ArrowItem]:
    """Return all forces and couples on all bodies, each the way in which its letter counts, as in the equations."""
    return _arrows(cut, list(cut.pulls()), lambda pull: abs(pull.value) * pull.way)


def reaction_arrows(cut: CutFree) -> tuple[ArrowItem, ...]:
    """Return what joints, contacts, ropes, rods and stops exert, as it acts: on the child, ropes at both ends."""
    pulls, seen = [], set()
    for pull in cut.pulls():
        place = (pull.key, pull.turns)
        if pull.at.body in cut.ground or pull.is_applied or (place in seen and not pull.both):
            continue
        seen.add(place)
        pulls.append(pull)
    return tuple(_arrows(cut, pulls, lambda pull: pull.vector))


def applied_arrows(cut: CutFree) -> tuple[ArrowItem, ...]:
    """Return the weights, and the pulls of springs and the like, which no arrow of the scene shows."""
    shown = {arrow.path for arrow in cut.scene.arrows} | {i.path for i in cut.scene.items if i.role == "drum"}
    pulls = [pull for pull in cut.pulls() if pull.is_applied and pull.path not in shown and pull.key[0] != "drive"]
    return tuple(_arrows(cut, [p for p in pulls if p.at.body not in cut.ground], lambda pull: pull.vector))


def _arrows(cut: CutFree, pulls: Sequence[ForceArrow], drawn: Callable[[ForceArrow], Floats]) -> list[ArrowItem]:
    """Return arrows of what is more than rounding, couples also of the moments that forces have; what is open, of all.

    That points as its possible value does, where this is none the way in which its letter counts.
    """
    known = [pull for pull in pulls if np.isfinite(pull.size)]
    forces, couples = (max((p.size for p in known if p.turns == turns), default=0.0) for turns in (False, True))
    largest = {False: forces, True: max(couples, forces * cut.scene.size)}
    seen = [pull.size > _NEGLIGIBLE * largest[pull.turns] for pull in pulls]
    pairs = zip(pulls, seen, strict=True)
    kept = [pull if large else replace(pull, value=1.0) for pull, large in pairs if large or pull.open]
    names = force_names(cut.system, cut.scene.mechanism, [*dict.fromkeys(pull.key for pull in kept), *cut.lasting()])
    found = []
    for pull in kept:
        if np.isfinite(pull.vector).all():
            role: Literal["force", "torque", "reaction", "couple"] = "couple" if pull.turns else "reaction"
            if pull.is_applied:
                role = "torque" if pull.turns else "force"
            name, way = names[pull.key], vector(drawn(pull))
            found.append(ArrowItem(role, pull.path[1], name, pull.path, pull.at, way, open=pull.open))
    return found
