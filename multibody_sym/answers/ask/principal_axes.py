"""`ask: {J: {principal_axes: body}}`: principal moments of inertia about the centre of mass, and their axes.

Of several bodies these are the moments of all together, as they lie at the start (parallel axes, Huygens and Steiner).
Where one coordinate axis is principal, the two others follow as a book has them:

    tan(2 a) = 2 J_xy/(J_xx - J_yy)        J_1,2 = (J_xx + J_yy)/2 -+ sqrt((J_xx - J_yy)^2/4 + J_xy^2)

In: a solved start. Out: moments J.1 <= J.2 <= J.3 in the axes of the first body, with the angle of the first axis in
their plane, or its direction and the others' in space.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial, reduce
from typing import Any, Final, NamedTuple, Self

import numpy as np

from multibody_sym.answers.ask.question import AskedMotion, Question
from multibody_sym.answers.ask.working import Working, equation
from multibody_sym.answers.instant.instant import SolvedInstant, with_letters
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.dynamics.programs.quantities import StateQuantities, body_momenta, centre_of_mass
from multibody_sym.mechanics.motion import Motion
from multibody_sym.model.fields import AXES
from multibody_sym.model.settings import Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars import vectors
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import atan2, sqrt
from multibody_sym.scalars.node import Node, as_node, real, symbol
from multibody_sym.scalars.vectors import Mat, S
from multibody_sym.text.values import Value

_UNIT: Final = "kg*m^2"
_NOTHING: Final = 1e-12
"""The part of the largest moment below which a product of inertia is zero, and moments are equal."""
_ANGLE: Final = symbol("alpha")


def inertia_about_centre(motion: Motion, bodies: tuple[int, ...]) -> Mat:
    """Return the tensor of some bodies about their centre of mass, in the axes of the first, over any scalar."""
    momenta = body_momenta(motion)
    parts = [momenta[k] for k in bodies]
    centre = centre_of_mass(parts)
    tensors = []
    for k, part in zip(bodies, parts, strict=True):
        r = vectors.subtract(part.com, centre)
        own = vectors.turned_tensor(motion.poses[k][0], motion.masses[k].inertia)
        away = vectors.steiner(r, r)
        x, y, z = (vectors.scale(part.mass, row) for row in away)
        tensors.append(vectors.matrix_sum(own, (x, y, z)))
    R = motion.poses[bodies[0]][0]
    return vectors.turned_tensor(vectors.transpose(R), reduce(vectors.matrix_sum, tensors))


def inertia_in_numbers(motion: Motion, bodies: tuple[int, ...]) -> Floats:
    """Return the tensor in floats (3, 3), zeros of what has no mass."""
    if not sum(motion.masses[k].mass for k in bodies):
        return np.zeros((3, 3))
    return np.array(inertia_about_centre(motion, bodies), dtype=float)


class _Plane(NamedTuple):
    """A coordinate axis `k` that is principal, and the others `i` and `j`, which are not where J_ij differs from 0."""

    i: int
    j: int
    k: int

    def moments(self, tensor: Mat) -> tuple[S, S, S]:
        """Return the lesser and the greater moment in the plane, and that about its normal."""
        a, b, c = tensor[self.i][self.i], tensor[self.j][self.j], tensor[self.i][self.j]
        middle, size = (a + b) / 2, sqrt((a - b) * (a - b) / 4 + c * c)
        return middle - size, middle + size, tensor[self.k][self.k]

    def angle(self, tensor: Mat) -> S:
        """Return the angle of the lesser moment's axis from axis i towards axis j."""
        a, b, c = tensor[self.i][self.i], tensor[self.j][self.j], tensor[self.i][self.j]
        return atan2(-2 * c, b - a) / 2


_PLANES: Final = (_Plane(0, 1, 2), _Plane(1, 2, 0), _Plane(2, 0, 1))


@dataclass(frozen=True)
class PrincipalAxesQuestion(Question):
    """The principal moments and axes of some bodies together."""

    si_unit = _UNIT
    is_of_start = True

    bodies: tuple[str, ...]

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.principal_axes is None else cls(tuple(dict.fromkeys(ask.principal_axes)))

    def words(self) -> str:
        return f"principal moments of inertia of {', '.join(self.bodies)}"

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        solved = motion.solved
        places = tuple(map(solved.mechanism.body_index, self.bodies))
        tensor = inertia_in_numbers(solved.numbers.motion, places)
        least = _NOTHING * float(np.abs(tensor).max())
        if not least:
            working.notes.append("it has no inertia")
            return {"": Value(None, unit=_UNIT)}
        mixed = [plane for plane in _PLANES if abs(tensor[plane.i, plane.j]) > least]
        working.steps.append(partial(self._tensor_lines, solved, places, least))
        if len(mixed) > 1:
            found = _in_space(tensor)
        elif mixed:
            found = self._in_plane(solved, mixed[0], working)
        else:
            found = self._along_axes(solved, working)
        moments = [found[f".{n}"].value or 0.0 for n in (1, 2, 3)]
        if min(np.diff(moments)) > least:
            told = "the free body turns steadily about axes 1 and 3; about axis 2 it is unstable (Poinsot)"
            working.steps.append(lambda: [Sentence((told,))])
        return found

    def _asked(self, solved: SolvedInstant, ask: Any, unit: str = _UNIT) -> Value:
        places = tuple(map(solved.mechanism.body_index, self.bodies))

        def of(instant: StateQuantities) -> Mapping[str, Any]:
            return {"": ask(inertia_about_centre(instant.motion, places))}

        return with_letters(solved, of, {"": unit})[""]

    def _along_axes(self, solved: SolvedInstant, working: Working) -> dict[str, Value]:
        """Return the moments about axes of the body, in the order of their size."""
        found = [self._asked(solved, lambda tensor, k=k: tensor[k][k]) for k in range(3)]
        order = sorted(range(3), key=lambda k: found[k].value or 0.0)
        named = ", ".join(f"{n} is {AXES[k]}" for n, k in enumerate(order, start=1))
        working.notes.append(f"the axes of {self.bodies[0]} are principal: axis {named}")
        return {f".{n}": found[k] for n, k in enumerate(order, start=1)}

    def _in_plane(self, solved: SolvedInstant, plane: _Plane, working: Working) -> dict[str, Value]:
        """Return the moments where one axis of the body is principal, and the angle of the lesser one's axis."""
        found = [self._asked(solved, lambda tensor, k=k: plane.moments(tensor)[k]) for k in range(3)]
        order = sorted(range(3), key=lambda k: found[k].value or 0.0)
        angle = self._asked(solved, plane.angle, "rad")
        i, j, k = (AXES[x] for x in plane)
        numbers = {role: n for n, role in enumerate(order, start=1)}
        working.notes.append(
            f"axis {numbers[0]} lies at the angle from {i} towards {j} of {self.bodies[0]}, axis {numbers[1]} at right "
            f"angles to it, axis {numbers[2]} along {k}"
        )
        working.steps.append(lambda: self._plane_lines(plane))
        return {**{f".{n}": found[role] for n, role in enumerate(order, start=1)}, ".angle": angle}

    # --- steps ----------------------------------------------------------------------------------------------------

    def _entry(self, solved: SolvedInstant, i: int, j: int) -> Node:
        """Return an element of the tensor as a formula, or its number."""
        value = self._asked(solved, lambda tensor: tensor[i][j])
        return real(value.value or 0.0) if value.expression is None else value.expression

    def _tensor_lines(self, solved: SolvedInstant, places: tuple[int, ...], least: float) -> Iterator[Line]:
        if len(places) > 1:
            yield Sentence((f"about the common centre of mass, in the axes of {self.bodies[0]} (parallel axes)",))
        tensor = inertia_in_numbers(solved.numbers.motion, places)
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            if abs(tensor[i, j]) > least:
                yield equation(symbol(f"J_{AXES[i]}{AXES[j]}"), self._entry(solved, i, j))

    def _plane_lines(self, plane: _Plane) -> Iterator[Line]:
        i, j = AXES[plane.i], AXES[plane.j]
        a, b, c = (symbol(f"J_{x}") for x in (f"{i}{i}", f"{j}{j}", f"{min(i, j)}{max(i, j)}"))
        double = as_node(2) * c / (a - b)
        yield equation(BUILD["tan"](as_node(2) * _ANGLE), double, "principal axes in their plane")


def _in_space(tensor: Floats) -> dict[str, Value]:
    """Return moments and directions in numbers: roots of a cubic equation."""
    moments, axes = np.linalg.eigh(tensor)
    found = {f".{n + 1}": Value(float(x), unit=_UNIT) for n, x in enumerate(moments)}
    for n in range(3):
        axis = axes[:, n] * np.sign(axes[np.argmax(np.abs(axes[:, n])), n])
        found |= {f".{n + 1}.{x}": Value(float(axis[k]), unit="") for k, x in enumerate(AXES)}
    return found
