"""What pulls at bodies that are cut free: weights, loads, joints, ropes, rods, contacts and friction, one by one."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.answers.cut_free.joints import JointForces, shown_components
from multibody_sym.answers.cut_free.records import Body, Key, Pull, Values
from multibody_sym.kinematics.contacts import touch
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.rows import row_motion
from multibody_sym.kinematics.wrenches import NO_WRENCH, Wrench
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.loads import JointForce, JointSpring, Load
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay, component_names
from multibody_sym.model.mechanism.rows import RopeRow, Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S, Vec
from multibody_sym.scene.forms import vector
from multibody_sym.scene.items import Anchor, Placed, PlacedStrand
from multibody_sym.scene.scene import Scene
from multibody_sym.scene.stage import Stage

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
    def stage(self) -> Stage:
        """The numbers of what is declared."""
        return Stage(self.system, self.scene.mechanism, self.scene.begin)

    def pulls(self) -> Iterator[Pull]:
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

    def _weights(self) -> Iterator[Pull]:
        gravity = np.asarray(self.scene.gravity)
        for k, mass in enumerate(self.motion.masses):
            name = self.scene.mechanism.bodies[k].name
            at = np.array([float(x) for x in mass.com])
            yield from self._force(("weight", name), ("bodies", name), k, float(mass.mass) * gravity, at, 1.0)

    def _load(self, load: Load) -> Iterator[Pull]:
        wrenches = applied(self.motion, [load], weight=False).of_body
        places = {marker.body: self._point(marker.body, marker.pose.position) for marker in load.points}
        for k, wrench in enumerate(wrenches):
            yield from self._wrench(("load", load.name), load.path, k, wrench, 1.0, places.get(k))

    # --- joints ----------------------------------------------------------------------------------------------------

    def _joints(self) -> Iterator[Pull]:
        for name, joint in self.system.joints.items():
            if name not in self.values:
                continue
            parent, child = self.stage.place(joint.parent), self.stage.place(joint.child)
            axes = self.placed.poses[parent.body][:, :3] @ parent.rotation
            where = self.placed.world(child.body, np.array([child.point]))[0]
            for key, turns, way, value in self._transmitted(name, axes):
                for body, sign in ((child.body, 1.0), (parent.body, -1.0)):
                    pull = self._couple if turns else self._force
                    yield from pull(key, ("joints", name), body, sign * way, self._within(body, where), value)

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

    def _rope(self, placed: PlacedStrand, number: int) -> Iterator[Pull]:
        """Yield the pull of each straight piece of a rope on what is at its ends."""
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
                yield from self._force(key, placed.strand.path, bend.at.body, sign * way, at, tension, both=True)

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

    def _rows(self) -> Iterator[Pull]:
        """Yield the forces of rows but ropes' and joints': rods, contacts, stops, friction."""
        names = {*self.system.joints, *self.system.contacts}
        for row in self.scene.mechanism.rows:
            told = [float(x) for x in self.values.get(row.name, {}).values()]
            if len(told) == 1 and row.name not in names and not isinstance(row, RopeRow):
                places = self._touched([row]) if isinstance(row, ContactRow) else None
                yield from self._exerted(row, told[0], ("row", row.name), ("constraints", row.name), places)
        for element in self.scene.mechanism.one_way:
            if element.kind in ("contact", "stop"):
                yield from self._of_element(element)

    def _of_element(self, element: OneWay) -> Iterator[Pull]:
        places = self._touched(list(element.rows))
        if element.unilateral:
            row = element.normals[0]
            component = "normal" if element.kind == "contact" else "force"
            yield from self._single(element, row, component, places)
        for part in element.frictions:
            yield from self._friction(element, part, places)

    def _friction(self, element: OneWay, part: FrictionPart, places: Mapping[Body, Floats]) -> Iterator[Pull]:
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
        self, element: OneWay, row: Row, component: str, places: Mapping[Body, Floats], slides: str = ""
    ) -> Iterator[Pull]:
        """Yield the force of one row, of one that is open without a value by its way."""
        value, is_open = self._value(element.name, component), (element.name, component) in self.open
        known = 1.0 if is_open and not np.isfinite(value) else value
        for pull in self._exerted(row, known, ("row", row.name), element.path, places, slides=slides):
            yield replace(pull, value=pull.value if np.isfinite(value) else value, open=True) if is_open else pull

    def _together(self, element: OneWay, part: FrictionPart, total: float) -> Iterator[Pull]:
        """Yield the friction of all corners of a contact, where only that is determined, once: where they press."""
        corners = [each for each in self.scene.mechanism.one_way if each.group == element.group]
        if corners[0] is not element:
            return
        at = np.array([self._value(element.group, f"at_{axis}") for axis in "xyz"])
        places = {k: self._within(k, at) for k in range(len(self.motion.bodies))} if np.isfinite(at).all() else None
        yield from self._exerted(part.rows[0], total, ("friction", element.group), element.path, places)

    def _touched(self, rows: Sequence[Row]) -> dict[Body, Floats]:
        """Return for each body where an element touches it, or the lines of all its forces meet (body axes)."""
        found: dict[Body, Floats] = {}
        if isinstance(rows[0], ContactRow):
            where = np.array(touch(rows[0].skins, self.motion, self._bias).place, dtype=float)
            return {k: self._within(k, where) for k in range(len(self.motion.bodies))}
        each = [self._unit(row) for row in rows]
        for k in range(len(self.motion.bodies)):
            forces = [(np.array(f, dtype=float), np.array(m, dtype=float)) for f, m in (one[k] for one in each)]
            forces = [(f, m) for f, m in forces if np.linalg.norm(f) > 0.0]
            if forces:
                matrix = np.vstack([-_crossing(f) for f, _ in forces])
                found[k] = least_squares(matrix, np.concatenate([m for _, m in forces]))
        return found

    @cached_property
    def _bias(self) -> Sequence[tuple[Vec, Vec]]:
        return accelerations(self.motion, [0] * len(self.motion.state.u))

    def _unit(self, row: Row) -> Sequence[Wrench]:
        """Return what a row exerts on the bodies (their axes) with a multiplier of 1."""
        return row_motion(row, self.motion, self._bias).of_body

    def _exerted(
        self, row: Row, value: float, key: Key, path: tuple[str, ...], places: Mapping[Body, Floats] | None,
        slides: str = "",
    ) -> Iterator[Pull]:  # fmt: skip
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
    ) -> Iterator[Pull]:
        """Yield a wrench (body axes, about its origin) as a force at a place, and as a couple what is left there."""
        force, moment = (np.array([float(x) for x in part]) for part in wrench)
        if place is None and force.any():
            place = np.cross(force, moment) / float(force @ force)
        at = _NONE if place is None else place
        turned = self.placed.poses[body][:, :3]
        couple = moment - np.cross(at, force)
        if np.linalg.norm(couple) <= 1e-9 * (np.linalg.norm(moment) + np.linalg.norm(at) * np.linalg.norm(force)):
            couple = _NONE
        yield from self._force(key, path, body, turned @ force, at, value)
        yield from self._couple(key, path, body, turned @ couple, at, value)

    def _force(
        self, key: Key, path: tuple[str, ...], body: Body, way: Floats, at: Floats, value: float, *, both: bool = False
    ) -> Iterator[Pull]:
        if way.any():
            yield Pull(key, path, Anchor(body, vector(at)), way, value, turns=False, both=both)

    def _couple(
        self, key: Key, path: tuple[str, ...], body: Body, way: Floats, at: Floats, value: float
    ) -> Iterator[Pull]:
        if way.any():
            yield Pull(key, path, Anchor(body, vector(at)), way, value, turns=True)

    def _point(self, body: Body, point: Sequence[object]) -> Floats:
        return np.array([float(x) for x in self.motion.state.values(list(point))])  # type: ignore[arg-type]

    def _within(self, body: Body, place: Floats) -> Floats:
        """Return a place in the world in the axes of a body."""
        pose = self.placed.poses[body]
        found: Floats = pose[:, :3].T @ (place - pose[:, 3])
        return found


def _crossing(a: Floats) -> Floats:
    """Return the matrix of a x b by b."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
