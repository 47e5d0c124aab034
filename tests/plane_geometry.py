"""Plane bodies by the coordinates x, y, phi of every centre of mass: rows of joints, contacts, stops and ropes.

Each row is written once, for complex numbers: its change along a motion is its imaginary part at q + i h u.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from plane_models import GROUND, Body, Contact, Model, Place, Plane, pose

TINY = 1e-30
"""The step h along a motion: its square is nothing beside 1."""


@dataclass(frozen=True)
class Element:
    """Something that holds one way only: its rows, coefficients of friction and of restitution."""

    name: str
    kind: str
    rows: Contact | tuple[int, float] | object
    static: float = 0.0
    kinetic: float = 0.0
    restitution: float = 0.0
    level: float = 0.0


@dataclass(frozen=True)
class Rows:
    """Gaps (m,), normal and tangent rows (m, 3 n), and the rates of both times the speeds (m,)."""

    gap: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    normal_rate: np.ndarray
    tangent_rate: np.ndarray


class Geometry:
    """All rows of a model: `held` ones of joints, and those of `elements`."""

    def __init__(self, model: Model) -> None:
        self.model, self.size = model, 3 * len(model.bodies)
        self.elements = [Element(c.name, "contact", c, c.static, c.kinetic, c.restitution) for c in model.contacts]
        for k, body in enumerate(model.bodies):
            for sign, level in ((1.0, body.joint.lower), (-1.0, body.joint.upper)):
                if level is not None:
                    e = body.joint.restitution
                    word = "lower" if sign > 0 else "upper"
                    self.elements.append(Element(f"J{body.name}.{word}", word, (k, sign), 0, 0, e, level))
        self.elements += [Element(r.name, "rope", r, 0, 0, r.restitution, r.length) for r in model.ropes]
        self.start = np.array([x for k in range(len(model.bodies)) for x in self._centre(k)])
        masses = [(b.mass, b.mass, b.inertia or 1.0) for b in model.bodies]
        self.mass = np.array(masses, dtype=float).ravel()
        self.of_joints = self._of_joints()

    def _centre(self, number: int) -> tuple[float, float, float]:
        x, y, angle = pose(self.model.bodies, number)
        turn = self.model.bodies[number].com * cmath.exp(1j * angle)
        return x + turn.real, y + turn.imag, angle

    # --- places

    def point(self, q: Sequence[complex], place: Place) -> tuple[complex, complex, complex, complex]:
        """Return where a place is, and its arm from the centre of mass."""
        if place.body == GROUND:
            return place.x, place.y, 0.0, 0.0
        k = 3 * place.body
        c, s = cmath.cos(q[k + 2]), cmath.sin(q[k + 2])
        x, y = place.x - self.model.bodies[place.body].com, place.y
        arm = c * x - s * y, s * x + c * y
        return q[k] + arm[0], q[k + 1] + arm[1], *arm

    @staticmethod
    def push(row: np.ndarray, body: int, way: tuple[complex, complex], arm: tuple[complex, complex]) -> None:
        """Add to a row the speed of a place along a way."""
        if body != GROUND:
            k = 3 * body
            row[k] += way[0]
            row[k + 1] += way[1]
            row[k + 2] += arm[0] * way[1] - arm[1] * way[0]

    # --- rows of elements

    def rows(self, q: np.ndarray, u: np.ndarray, which: Sequence[int]) -> Rows:
        """Return the rows of some elements."""
        z = (q + 1j * TINY * u).tolist()
        gap = np.zeros(len(which), dtype=complex)
        normal, tangent = (np.zeros((len(which), self.size), dtype=complex) for _ in range(2))
        for k, number in enumerate(which):
            element = self.elements[number]
            fill = {"contact": self._contact, "rope": self._rope}.get(element.kind, self._stop)
            gap[k] = fill(z, element, normal[k], tangent[k])
        rates = normal.imag @ u / TINY, tangent.imag @ u / TINY
        return Rows(gap.real, normal.real.copy(), tangent.real.copy(), *rates)

    def _contact(self, z: list[complex], element: Element, normal: np.ndarray, tangent: np.ndarray) -> complex:
        contact = element.rows
        first, second = contact.first, contact.second
        x, y, *arm = self.point(z, first)
        r, size = contact.radii
        if isinstance(second, Plane):
            n = second.normal
            gap = (x - second.x) * n[0] + (y - second.y) * n[1] - r
        else:
            xb, yb, *arm_b = self.point(z, second)
            d = cmath.sqrt((x - xb) ** 2 + (y - yb) ** 2)
            n, gap = ((x - xb) / d, (y - yb) / d), d - r - size
        t = n[1], -n[0]
        touch = arm[0] - r * n[0], arm[1] - r * n[1]
        self.push(normal, first.body, n, touch)
        self.push(tangent, first.body, t, touch)
        if not isinstance(second, Plane):
            touch = arm_b[0] + size * n[0], arm_b[1] + size * n[1]
            self.push(normal, second.body, (-n[0], -n[1]), touch)
            self.push(tangent, second.body, (-t[0], -t[1]), touch)
        return gap

    def _rope(self, z: list[complex], element: Element, normal: np.ndarray, tangent: np.ndarray) -> complex:
        length: complex = 0.0
        path = element.rows.path
        places = [self.point(z, place) for place in path]
        for k in range(len(path) - 1):
            (xa, ya, *arm_a), (xb, yb, *arm_b) = places[k], places[k + 1]
            d = cmath.sqrt((xa - xb) ** 2 + (ya - yb) ** 2)
            e = (xa - xb) / d, (ya - yb) / d
            self.push(normal, path[k].body, (-e[0], -e[1]), arm_a)
            self.push(normal, path[k + 1].body, e, arm_b)
            length += d
        return element.level - length

    def _stop(self, z: list[complex], element: Element, normal: np.ndarray, tangent: np.ndarray) -> complex:
        number, sign = element.rows
        joint = self.model.bodies[number].joint
        k, parent = 3 * number, joint.parent
        if joint.kind == "slide":
            axis = cmath.cos(joint.angle), cmath.sin(joint.angle)
            self.push(normal, number, (sign * axis[0], sign * axis[1]), (0.0, 0.0))
            return sign * ((z[k] - parent.x) * axis[0] + (z[k + 1] - parent.y) * axis[1] - element.level)
        normal[k + 2] = sign
        if parent.body != GROUND:
            normal[3 * parent.body + 2] = -sign
        return sign * (z[k + 2] - (z[3 * parent.body + 2] if parent.body != GROUND else 0.0) - element.level)

    # --- rows of joints

    def held(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return phi (b,), rows (b, 3 n) and their rates times the speeds of what joints hold."""
        z = (q + 1j * TINY * u).tolist()
        phi, rows = list[complex](), list[np.ndarray]()
        for number, body in enumerate(self.model.bodies):
            for value, row in self._joint(z, number, body):
                phi.append(value)
                rows.append(row)
        matrix = np.array(rows) if rows else np.zeros((0, self.size), dtype=complex)
        return np.array(phi, dtype=complex).real, matrix.real.copy(), matrix.imag @ u / TINY

    def _joint(self, z: list[complex], number: int, body: Body) -> list[tuple[complex, np.ndarray]]:
        joint, k = body.joint, 3 * number
        blank = [np.zeros(self.size, dtype=complex) for _ in range(2)]
        if joint.kind in ("slide", "point"):
            blank[1][k + 2] = 1.0
            if joint.kind == "point":
                return [(z[k + 2], blank[1])]
            across = -cmath.sin(joint.angle), cmath.cos(joint.angle)
            self.push(blank[0], number, across, (0.0, 0.0))
            value = (z[k] - joint.parent.x) * across[0] + (z[k + 1] - joint.parent.y) * across[1]
            return [(value, blank[0]), (z[k + 2], blank[1])]
        if joint.kind != "hinge":
            return []
        xa, ya, *arm_a = self.point(z, Place(number))
        xb, yb, *arm_b = self.point(z, joint.parent)
        for row, way in zip(blank, ((1.0, 0.0), (0.0, 1.0)), strict=True):
            self.push(row, number, way, arm_a)
            self.push(row, joint.parent.body, (-way[0], -way[1]), arm_b)
        return [(xa - xb, blank[0]), (ya - yb, blank[1])]

    # --- forces

    def forces(self, t: float, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return what gravity, springs and pushes exert (3 n,)."""
        f = np.zeros(self.size)
        f[1::3] -= self.model.gravity * self.mass[1::3]
        for push in self.model.pushes:
            k, wave = 3 * push.body, np.sin(push.rate * t)
            f[k] += push.force[0] + push.amplitude[0] * wave
            f[k + 1] += push.force[1] + push.amplitude[1] * wave
            f[k + 2] += push.torque
        if self.model.springs:
            z = (q + 1j * TINY * u).tolist()
            for spring in self.model.springs:
                (xa, ya, *arm_a), (xb, yb, *arm_b) = (self.point(z, place) for place in (spring.first, spring.second))
                d = cmath.sqrt((xa - xb) ** 2 + (ya - yb) ** 2)
                pull = spring.stiffness * (d.real - spring.length) + spring.damping * d.imag / TINY
                e = pull * (xb - xa).real / d.real, pull * (yb - ya).real / d.real
                self.push(f, spring.first.body, e, [x.real for x in map(complex, arm_a)])
                self.push(f, spring.second.body, (-e[0], -e[1]), [x.real for x in map(complex, arm_b)])
        return f

    # --- the coordinates of joints

    def _of_joints(self) -> tuple[np.ndarray, np.ndarray]:
        """Return L and l of the joints' coordinates L q - l, in the order of a model file."""
        rows, places = list[np.ndarray](), list[float]()
        for number, body in enumerate(self.model.bodies):
            joint, k = body.joint, 3 * number
            for freedom in range(len(body.q)):
                row = np.zeros(self.size)
                place = 0.0
                if joint.kind == "slide":
                    row[k : k + 2] = np.cos(joint.angle), np.sin(joint.angle)
                    place = float(row[k : k + 2] @ (joint.parent.x, joint.parent.y))
                elif joint.kind == "hinge":
                    row[k + 2] = 1.0
                    row[3 * joint.parent.body + 2] -= float(joint.parent.body != GROUND)
                else:
                    row[k + freedom] = 1.0
                rows.append(row)
                places.append(place)
        return np.array(rows), np.array(places)

    def speeds_at_start(self) -> np.ndarray:
        """Return the speeds (3 n,) of all centres that the joints' speeds make."""
        held = self.held(self.start, np.zeros(self.size))[1]
        wanted = [value for body in self.model.bodies for value in body.u]
        return np.linalg.solve(np.vstack([held, self.of_joints[0]]), np.concatenate([np.zeros(len(held)), wanted]))
