"""Bodies cut free: a figure of each with all forces on it at the start, as numbers and geometry have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.answers.solution import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.drawing.draw import draw as draw_scene
from multibody_sym.drawing.figure import Figure
from multibody_sym.drawing.shown import Shown
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.rows import row_motion
from multibody_sym.kinematics.wrenches import Wrench
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import RopeRow, Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import Vec, scale
from multibody_sym.scene.forms import vector
from multibody_sym.scene.items import Anchor, ArrowItem, Placed
from multibody_sym.scene.scene import Scene, scene_of
from multibody_sym.scene.stage import Stage

_ROLES: Final = ("body", "mass centre", "pulley", "gear")
_NEGLIGIBLE: Final = 1e-9
MOST: Final = 12
"""Systems of more bodies have no figure of each: nobody would look at them."""


def free_bodies(system: System) -> Mapping[str, Figure]:
    """Return a figure of each body with the forces on it: weight, loads, joints, ropes, contacts.

    None for an impact and for many bodies. Raises what `solve` raises.
    """
    if len(system.bodies) > MOST or system.impact is not None:
        return {}
    scene = scene_of(system)
    cut = _Cut(system, scene, scene.at(), solve(system))
    arrows = list(cut.arrows())
    largest = max((float(np.linalg.norm(arrow.vector)) for arrow in arrows), default=0.0)
    kept = [arrow for arrow in arrows if np.linalg.norm(arrow.vector) > _NEGLIGIBLE * largest]
    bodies = scene.mechanism.bodies
    return {
        body.name: cut.figure(k, [arrow for arrow in kept if arrow.at.body == k])
        for k, body in enumerate(bodies)
        if not (body.is_double or body.is_foot) and any(arrow.at.body == k for arrow in kept)
    }


@dataclass(frozen=True, eq=False)
class _Cut:
    """A system at its start, whose bodies are cut free of each other."""

    system: System
    scene: Scene
    placed: Placed
    solution: Solution

    @cached_property
    def stage(self) -> Stage:
        """The numbers of what is declared."""
        return Stage(self.system, self.scene.mechanism, self.scene.begin)

    @property
    def motion(self) -> Motion:
        """The motion of all bodies at the start."""
        return self.stage.motion

    @cached_property
    def _bias(self) -> Sequence[tuple[Vec, Vec]]:
        return accelerations(self.motion, [0] * len(self.motion.state.u))

    def figure(self, body: int, arrows: Sequence[ArrowItem]) -> Figure:
        """Return a body alone with the forces on it."""
        items = tuple(item for item in self.scene.items if item.body == body and item.role in _ROLES)
        alone = replace(
            self.scene, name=self.scene.mechanism.bodies[body].name, items=items, strands=(), dimensions=(), angles=(),
            arrows=(), ropes=(),
        )  # fmt: skip
        placed = replace(self.placed, strands=(), vectors=np.zeros((0, 3)))
        return Figure(draw_scene(alone, placed, shown=Shown(names=False, reactions=tuple(arrows))))

    def arrows(self) -> Iterator[ArrowItem]:
        """Yield all forces and couples on all bodies, in the world."""
        yield from self._weights()
        yield from self._loads()
        yield from self._joints()
        yield from self._ropes()
        yield from self._rows()

    def _weights(self) -> Iterator[ArrowItem]:
        gravity = np.asarray(self.scene.gravity)
        for k, mass in enumerate(self.motion.masses):
            name = self.scene.mechanism.bodies[k].name
            at = Anchor(k, vector([float(x) for x in mass.com]))
            yield ArrowItem("force", name, f"G_{name}", ("bodies", name), at, vector(float(mass.mass) * gravity))

    def _loads(self) -> Iterator[ArrowItem]:
        for load in self.scene.mechanism.loads:
            wrenches = applied(self.motion, [load], weight=False).of_body
            places = {marker.body: self._point(marker.body, marker.pose.position) for marker in load.points}
            for k, wrench in enumerate(wrenches):
                yield from self._arrows(load.name, load.path, k, wrench, places.get(k))

    def _joints(self) -> Iterator[ArrowItem]:
        for name, joint in self.system.joints.items():
            told = self.solution.reactions.get(name, {})
            values = [told[c].value if c in told else None for c in COMPONENTS]
            parent, child = self.stage.place(joint.parent), self.stage.place(joint.child)
            axes = self.placed.poses[parent.body][:, :3] @ parent.rotation
            six = np.array([np.nan if value is None else value for value in values])
            force, couple = axes @ self._seen(six[:3], axes, 0.0), axes @ self._seen(six[3:], axes, 1.0)
            if not np.isfinite([*force, *couple]).all():
                continue
            where = self.placed.world(child.body, np.array([child.point]))[0]
            for body, sign in ((child.body, 1.0), (parent.body, -1.0)):
                at = Anchor(body, vector(self._within(body, where)))
                yield ArrowItem("reaction", name, f"F_{name}", ("joints", name), at, vector(sign * force))
                yield ArrowItem("couple", name, f"M_{name}", ("joints", name), at, vector(sign * couple))

    def _seen(self, components: Floats, axes: Floats, upright: float) -> Floats:
        """Return components of a vector; of a plane mechanism those that no plane figure shows are zero.

        Forces lie in the plane (`upright` 0), couples across it (1); what redundant constraints leave open is the rest.
        """
        across = np.abs(np.asarray(self.scene.view.towards) @ axes)
        hidden = np.abs(across - upright) > 1.0 - 1e-9 if self.scene.plane else np.zeros(3, dtype=bool)
        found: Floats = np.where(hidden, 0.0, components)
        return found

    def _ropes(self) -> Iterator[ArrowItem]:
        """Yield the pull of each straight piece of a rope on what is at its ends."""
        for placed in self.placed.strands:
            rope = placed.strand.rope
            if rope is None:
                continue
            runs = self.scene.ropes[rope]
            bends = [bend for k, run in enumerate(runs) for bend in run.path[bool(k) :]]
            tensions = self._tensions(placed.strand.name, runs)
            if len(placed.pieces) != len(bends) - 1 or tensions is None:
                continue
            for k, (start, end) in enumerate(placed.pieces):
                run, tension = tensions[k]
                way = (end - start) / (np.linalg.norm(end - start) or 1.0)
                for bend, place, sign in ((bends[k], start, 1.0), (bends[k + 1], end, -1.0)):
                    at = Anchor(bend.at.body, vector(self._within(bend.at.body, place)))
                    pull = vector(sign * tension * way)
                    yield ArrowItem("reaction", placed.strand.name, run, placed.strand.path, at, pull)

    def _tensions(self, name: str, runs: Sequence[RopeRow]) -> list[tuple[str, float]] | None:
        """Return the letter and the tension of each piece of a rope; None where they are not known."""
        told = [x.value for part, x in self.solution.reactions.get(name, {}).items() if part.startswith("tension")]
        if not told or any(value is None for value in told):
            return None
        found = []
        for k, run in enumerate(runs):
            letter = f"T_{name}" if len(told) == 1 else f"T_{k + 1}"
            found += [(letter, float(told[min(k, len(told) - 1)] or 0.0))] * (len(run.path) - 1)
        return found

    def _rows(self) -> Iterator[ArrowItem]:
        """Yield the forces of rows but ropes' and joints': rods, contacts, stops, friction."""
        names = {*self.system.joints, *self.system.contacts}
        for row in self.scene.mechanism.rows:
            told = self.solution.reactions.get(row.name, {})
            values = [x.value for x in told.values()]
            if len(values) == 1 and values[0] is not None and row.name not in names and not isinstance(row, RopeRow):
                yield from self._exerted(row, float(values[0]), row.name, None)
        for element in self.scene.mechanism.one_way:
            if element.kind in ("contact", "friction", "stop"):
                yield from self._of_element(element)

    def _of_element(self, element: OneWay) -> Iterator[ArrowItem]:
        rows = {row.name.rpartition(".")[2]: row for row in element.rows}
        told = self.solution.reactions.get(element.name, {})
        places = self._touched(list(rows.values()))
        for part, letter in (("normal", "N"), ("friction", "R"), ("friction_1", "R"), ("friction_2", "R")):
            value = told[part].value if part in told else None
            row = rows.get(part)
            if row is not None and value is not None:
                yield from self._exerted(row, float(value), f"{letter}_{element.name}", places)

    def _touched(self, rows: Sequence[Row]) -> dict[int, Floats]:
        """Return for each body the place where the lines of all forces of an element meet (body axes)."""
        found: dict[int, Floats] = {}
        each = [self._unit(row) for row in rows]
        for k in range(len(self.motion.bodies)):
            forces = [(np.array(f, dtype=float), np.array(m, dtype=float)) for f, m in (one[k] for one in each)]
            forces = [(f, m) for f, m in forces if np.linalg.norm(f) > 0.0]
            if forces:
                matrix = np.vstack([-_crossing(f) for f, _ in forces])
                found[k] = least_squares(matrix, np.concatenate([m for _, m in forces]))
        return found

    def _unit(self, row: Row) -> Sequence[Wrench]:
        """Return what a row exerts on the bodies (their axes) with a multiplier of 1."""
        return row_motion(row, self.motion, self._bias).of_body

    def _exerted(
        self, row: Row, value: float, label: str, places: Mapping[int, Floats] | None
    ) -> Iterator[ArrowItem]:
        for k, (force, moment) in enumerate(self._unit(row)):
            wrench = scale(value, force), scale(value, moment)
            place = None if places is None else places.get(k)
            yield from self._arrows(label, ("constraints", row.name), k, wrench, place)

    def _arrows(
        self, label: str, path: tuple[str, ...], body: int, wrench: Wrench, place: Floats | None
    ) -> Iterator[ArrowItem]:
        """Yield a wrench (body axes, about its origin) as a force at a place, and as a couple what is left there."""
        force, moment = (np.array([float(x) for x in part]) for part in wrench)
        if place is None and force.any():
            place = np.cross(force, moment) / float(force @ force)
        at = np.zeros(3) if place is None else place
        turned = self.placed.poses[body][:, :3]
        anchor = Anchor(body, vector(at))
        couple = moment - np.cross(at, force)
        if np.linalg.norm(couple) <= 1e-9 * (np.linalg.norm(moment) + np.linalg.norm(at) * np.linalg.norm(force)):
            couple = np.zeros(3)
        yield ArrowItem("reaction", label, label, path, anchor, vector(turned @ force))
        yield ArrowItem("couple", label, label, path, anchor, vector(turned @ couple))

    def _point(self, body: int, point: Sequence[object]) -> Floats:
        return np.array([float(x) for x in self.motion.state.values(list(point))])  # type: ignore[arg-type]

    def _within(self, body: int, place: Floats) -> Floats:
        """Return a place in the world in the axes of a body."""
        pose = self.placed.poses[body]
        found: Floats = pose[:, :3].T @ (place - pose[:, 3])
        return found


def _crossing(a: Floats) -> Floats:
    """Return the matrix of a x b by b."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
