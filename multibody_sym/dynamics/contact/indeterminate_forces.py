"""Forces that are not unique, as of a box on four corners in space: shares that keep away from all bounds.

All rows of the mode act and carry shares of the forces, at the inner point of the cones of friction. While the mode
lasts the shares change as little as possible, in the norm of that point's motion: forces near a bound take little of
the change. When a share reaches its bound, shares are chosen anew; without room for any the mode ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import FrictionLaw, LawState
from multibody_sym.dynamics.contact.contact_problem import PosedLaws
from multibody_sym.mechanics.law_elements import STICKS, LawElement, Mode, Share, Shares
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import most, sliding
from multibody_sym.scalars.linear_inequalities import Cone, Inside, inner_point
from multibody_sym.scalars.rank import SWITCHED, least_squares, null_space, row_space

CLEAR: Final = 1e-11
"""Shares that are this part of the largest force away from all bounds are clearly inside."""
_MOST_CURVED: Final = 1e8
"""The second derivative at a ten thousandth of the largest force from a bound; larger ones count as this one.

Without it the rows of a contact without force, as of a wall beside a disc in a corner, exert so little that the solve
for the motion along them is rounding.
"""
_LEAST_CURVED: Final = 0.1
"""Smaller second derivatives count as this one, so that their inverse stays finite."""


@dataclass(frozen=True, eq=False)
class _Sharing:
    """The rows that act in a mode, by the problem's places, with their forces, sliding friction included."""

    posed: PosedLaws
    mode: Mode
    rows: tuple[int, ...]
    exerted: Floats

    def place(self, name: str) -> int:
        return self.rows.index(self.posed.places[name])


def with_shares(posed: PosedLaws, mode: Mode, state: LawState) -> Mode:
    """Return a mode with the shares of all its rows; unchanged where no force presses."""
    one = _acting_rows(posed, mode)
    lengths: Floats = np.linalg.norm(one.exerted, axis=1)  # one for all rows of a friction part
    for *_, law in _parts(posed, mode):
        own = [one.rows.index(row) for row in law.rows if row in one.rows]
        lengths[own] = lengths[own].max(initial=0.0)
    lengths[lengths == 0.0] = 1.0
    unit = one.exerted / lengths[:, None]
    start = least_squares(unit.T, state.x, SWITCHED)
    largest = float(np.abs(start).max(initial=0.0))
    if not largest > 0.0:
        return mode
    start, sizes = start / largest, largest / lengths
    bounds = _cones(one, sizes)
    found = inner_point(start, null_space(unit.T, SWITCHED), *bounds)
    if found.room <= CLEAR:  # other forces may change the motion of sliding parts
        kept = row_space(posed.problem.matrix[list(one.rows)], SWITCHED)
        found = inner_point(start, null_space(kept @ unit.T, SWITCHED), *bounds)
    return replace(mode, shares=Shares(tuple(_shares(one, found, sizes)), found.room))


def _acting_rows(posed: PosedLaws, mode: Mode) -> _Sharing:
    rows = [posed.places[row.name] for row in posed.mechanism.rows]
    exerted = posed.problem.exerted.copy()
    for element, part, law in _parts(posed, mode):
        slip = mode.slips.get(part, STICKS)
        normal = posed.places[element.normals[0].name]
        if slip != STICKS:  # friction along each row for a unit normal force
            if len(law.rows) == 1:
                friction = np.array(sliding(law.kinetic, [slip]))
            else:
                direction = mode.directions.get(part)
                way = law.velocity if not law.rests or direction is None else direction
                friction = np.array(sliding(law.kinetic, way, max(float(np.linalg.norm(way)), 1e-300)))
            exerted[normal] += friction @ posed.problem.exerted[list(law.rows)]
    for element in _elements(posed, mode):
        rows.append(posed.places[element.normals[0].name])
        own = (law for x, part, law in _parts(posed, mode) if x is element and mode.slips.get(part, STICKS) == STICKS)
        rows += [row for law in own if law.enough or law.static > 0.0 for row in law.rows]
    return _Sharing(posed, mode, tuple(rows), exerted[rows])


def _elements(posed: PosedLaws, mode: Mode) -> list[LawElement]:
    return [x for x in posed.elements if x.unilateral and mode.acts(x) and x.name not in mode.idle]


def _parts(posed: PosedLaws, mode: Mode) -> Iterator[tuple[LawElement, str, FrictionLaw]]:
    laws = {part.name: law for part, law in zip(posed.parts, posed.problem.parts, strict=True)}
    for element in _elements(posed, mode):
        yield from ((element, part.name, laws[part.name]) for part in element.frictions if part.name in laws)


def _cones(one: _Sharing, sizes: Floats) -> tuple[list[Cone], list[int]]:
    """Return the bounds of the acting rows, in forces over their `sizes`, and the rows without bounds."""
    places = {row: k for k, row in enumerate(one.rows)}
    loose = [places[one.posed.places[row.name]] for row in one.posed.mechanism.rows]
    found = []
    for element in _elements(one.posed, one.mode):
        found.append(Cone((), (one.place(element.normals[0].name),), (1.0,)))
    for element, part, law in _parts(one.posed, one.mode):
        if one.mode.slips.get(part, STICKS) != STICKS or not (law.enough or law.static > 0.0):
            continue
        own = tuple(places[row] for row in law.rows)
        if law.enough:
            loose += own
        else:
            normal = one.place(element.normals[0].name)
            found.append(Cone(own, (normal,), (most(law.static, float(sizes[normal] / sizes[own[0]])),)))
    return found, loose


def _shares(one: _Sharing, found: Inside, sizes: Floats) -> Iterator[Share]:
    """Yield the shares of each element, with ways of which the longest exerts a force of length one."""
    count = len(one.posed.mechanism.rows)
    normals = {one.posed.places[x.normals[0].name] for x in _elements(one.posed, one.mode)}
    begins = [k for k in range(count, len(one.rows)) if one.rows[k] in normals]
    groups: list[tuple[int, ...]] = [(k,) for k in range(count)]  # the model's own rows, then each element's
    groups += [tuple(range(a, b)) for a, b in zip(begins, [*begins[1:], len(one.rows)], strict=True)]
    roots = [_root(found.hessian[np.ix_(group, group)]) * sizes[list(group)][:, None] for group in groups]
    pairs = list(zip(groups, roots, strict=True))
    longest = max(float(np.linalg.norm(way @ one.exerted[list(g)])) for g, root in pairs for way in root.T)
    names = {place: name for name, place in one.posed.places.items()}
    for group, root in pairs:
        ways = tuple(tuple((root[k:, k] / longest).tolist()) for k in range(len(group)))
        forces = tuple((found.z * sizes)[list(group)].tolist())
        yield Share(tuple(names[one.rows[k]] for k in group), forces, ways)


def _root(hessian: Floats) -> Floats:
    """Return lower triangular L with L L^T the inverse of second derivatives within their bounds."""
    sizes, axes = np.linalg.eigh(hessian)
    inverse = axes / np.clip(sizes, _LEAST_CURVED, _MOST_CURVED) @ axes.T
    return np.asarray(np.linalg.cholesky(inverse), dtype=float)
