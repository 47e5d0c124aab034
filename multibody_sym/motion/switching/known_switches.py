"""Switches that were decided before: the mode to which one led then is verified, and only where it fails searched.

A run that chatters meets the same few switches again and again. What follows is what the search finds first as well.
Where a speed has come to zero it begins with the mode to which that led before, and takes it where all laws hold; where
a force has come to its limit, it flips what is there in the mode that ends as soon as that is clearly beyond. Here laws
have to hold clearly, by three times of what the search allows; ties, impacts, friction in joints and in space are left
to the search. `turns.c` does the same.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from multibody_sym.dynamics.programs.reactions import Switching
from multibody_sym.mechanics.law_elements import INACTIVE, STICKS, FrictionPart, LawElement, Mode
from multibody_sym.mechanics.modes import has_rim
from multibody_sym.motion.loop.problem import ActiveRows, Rub
from multibody_sym.motion.switching import impact
from multibody_sym.motion.switching.decision import SOON, NextState
from multibody_sym.motion.switching.law_mechanism import is_tip
from multibody_sym.motion.switching.law_values import Laws, LawValues
from multibody_sym.program.runtime_constants import CLEAR_BY, CLEAR_MOTION, DETERMINED, MOST_ACTIVE, WITHIN
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.least_norm import solve_lists
from multibody_sym.scalars.limits import most, room


@dataclass(frozen=True)
class KnownSwitch:
    """A switch that was decided: of what touches, with `signs` of slip of its parts, and the `mode` that followed.

    `cause` is the place of the row whose condition ended the mode `before`, None where a speed did.
    """

    mode: Mode
    touching: tuple[str, ...]
    signs: tuple[tuple[FrictionPart, int], ...]
    rows: tuple[int, ...]
    after: ActiveRows
    before: ActiveRows | None = None
    cause: int | None = None


@dataclass(frozen=True, eq=False)
class Solved:
    """Forces z (m) and what is left a (m) of all rows, with what these are measured by, at rows of length one."""

    z: Floats
    a: Floats
    force: float
    terms: Floats


def known_switch(found: NextState, before: Mode, cause: Switching) -> KnownSwitch | None:
    """Return the record that recognises a decided switch of `plain` elements; None for impacts and several states."""
    facts, mode, posed = found.facts, found.mode, found.posed
    if mode is None or posed is None or found.blow is not None or found.several or mode == before:
        return None
    if cause.ends not in ("stops", "slips", "opens") or posed.problem.coupling.any():
        return None
    if any(x.idle or x.carried or x.directions or x.shares for x in (mode, before)):
        return None
    signs = tuple((part, _sign(facts, part)) for part in posed.parts)
    touching = tuple(element.name for element in posed.elements)
    after = _active_rows(facts.laws, mode, posed.elements, dict(signs))
    rows = tuple(facts.laws.places[name] for name in posed.names)
    if after is None or len(after.active) > MOST_ACTIVE:
        return None
    if cause.ends == "stops":
        return KnownSwitch(mode, touching, signs, rows, after)
    acting = _active_rows(facts.laws, before, posed.elements, dict(signs))
    row = cause.element.normals[0] if cause.part is None else cause.part.rows[0]
    if acting is None or len(acting.active) > MOST_ACTIVE:
        return None
    # The modes may differ in what has come to its limit alone.
    if cause.part is None:
        own = {part.name for part in cause.element.frictions}
        slips = {part: slip for part, slip in before.slips.items() if part not in own}
        flips = {**before.sides, cause.element.name: INACTIVE} == mode.sides and slips == mode.slips
    else:
        slip = mode.slips.get(cause.part.name, STICKS)
        flips = slip != STICKS and {**before.slips, cause.part.name: slip} == mode.slips
        flips = flips and before.sides == mode.sides
    if not flips:
        return None
    return KnownSwitch(mode, touching, signs, rows, after, acting, facts.laws.places[row.name])


def plain(element: LawElement) -> bool:
    """Return whether an element touches or not, and rubs in lines if it does, with no rim that may come to lie flat."""
    lines = all(len(p.rows) == 1 and not (p.norm or p.enough) and p.regularised is None for p in element.frictions)
    return element.unilateral and len(element.normals) == 1 and lines and not (is_tip(element) or has_rim(element))


def _sign(facts: LawValues, part: FrictionPart) -> int:
    """Return which way a part slides, 0 at rest."""
    speed = float(facts.known["phidot"][facts.place(part.rows[0])])
    return 0 if abs(speed) <= facts.allowed_slip(part) else 1 if speed > 0.0 else -1


def _active_rows(
    laws: Laws, mode: Mode, touching: Sequence[LawElement], signs: Mapping[FrictionPart, int]
) -> ActiveRows | None:
    """Return the rows that act in a mode; None if it contradicts the signs of slip."""
    active, slides, sticks = [laws.places[row.name] for row in laws.mechanism.rows], list[Rub](), list[Rub]()
    pressing, apart = list[int](), list[int]()
    for element in touching:
        normal = laws.places[element.normals[0].name]
        if mode.sides.get(element.name, INACTIVE) == INACTIVE:
            apart.append(normal)
            continue
        pressing.append(normal)
        active.append(normal)
        for part in (part for part in element.frictions if part in signs):
            tangent, slip = laws.places[part.rows[0].name], mode.slips.get(part.name, STICKS)
            if signs[part] and slip != signs[part]:
                return None
            if slip == STICKS:
                sticks.append(Rub(normal, tangent, laws.parts[part.name]))
                active.append(tangent)
            else:
                slides.append(Rub(normal, tangent, laws.parts[part.name], slip, not signs[part]))
    return ActiveRows(tuple(active), tuple(slides), tuple(sticks), tuple(pressing), tuple(apart))


# --- verified ---------------------------------------------------------------------------------------------------------


def follow_known_switch(
    switch: KnownSwitch, facts: LawValues, closed: Collection[str], rates: tuple[Floats, Floats] | None = None
) -> NextState | None:
    """Return how a run goes on, None where it is not clear. `rates`: of coordinates and speeds in the mode before."""
    if tuple(facts.touching(closed)) != switch.touching:
        return None
    facts = impact.at_state(facts, q=impact.onto_rows(facts, switch.touching))
    if impact.approaching(facts, switch.touching):
        return None
    facts = impact.at_state(facts, u=impact.at_rest(facts, switch.touching))
    if switch.before is None or rates is None or switch.cause is None:
        solved = _holds(switch, facts, switch.after)
    else:
        solved = _holds_soon_after(switch, switch.before, switch.cause, facts, rates)
    if solved is None:
        return None
    largest = NextState.largest_of(solved.z, facts, list(switch.rows))
    return NextState(facts, switch.mode, largest, None, None)


def _holds_soon_after(
    switch: KnownSwitch, before: ActiveRows, cause: int, facts: LawValues, rates: tuple[Floats, Floats]
) -> Solved | None:
    """Return the forces soon after, where those of the mode before, which hold now, clearly exceed their limit."""
    for part in (0.0, *SOON):
        soon = part * facts.scale.time
        later = facts.laws.at(facts.t + soon, facts.q + soon * rates[0], facts.u + soon * rates[1], facts.scale)
        ended = _holds(switch, later, before, cause)
        if ended is None:
            return None
        # By how much the force at the row exceeds its limit, in the sense in which it gave way.
        size, over = float(np.linalg.norm(later.exerted[cause])), -float(ended.z[cause])
        for one in before.sticks:
            if one.tangent == cause:
                sense = next(slide.sense for slide in switch.after.slides if slide.tangent == cause)
                limit = float(most(later.known["coefficients"][one.part][0], ended.z[one.normal]))
                over = -sense * float(ended.z[cause]) - limit
                break
        over *= size
        if over > CLEAR_BY * ended.force:
            return _holds(switch, later, switch.after) if soon else None
        if over > WITHIN * CLEAR_BY * ended.force:
            return None
    return None


def _holds(switch: KnownSwitch, facts: LawValues, acting: ActiveRows, free: int | None = None) -> Solved | None:
    """Return the forces of what acts where its laws hold clearly, with static coefficients and then as it slides.

    What they say of the row `free` may be open.
    """
    if any(_sign(facts, part) != sign for part, sign in switch.signs):
        return None
    mu = facts.known["coefficients"]
    parts = [one.part for one in (*acting.slides, *acting.sticks)]
    if not all(float(mu[part, 0]) > 0.0 and float(mu[part, 1]) > 0.0 for part in parts):
        return None
    differ = any(one.begins and float(mu[one.part, 0]) != float(mu[one.part, 1]) for one in acting.slides)
    solved = None
    for static in (True, False) if differ else (False,):
        solved = _solve_forces(switch, facts, acting, static=static)
        if solved is None or not _hold_clearly(solved, facts, acting, free):
            return None
    return solved


def _solve_forces(switch: KnownSwitch, facts: LawValues, acting: ActiveRows, *, static: bool) -> Solved | None:
    """Return the forces of what acts; None where rows are nearly dependent."""
    known = facts.known
    A, C, right, active = facts.by_mass.whole, facts.exerted.whole, known["right"], list(acting.active)
    lengths, sizes = _lengths(A), _lengths(C)
    pushes = C[active].copy()
    for one in acting.slides:
        mu = known["coefficients"][one.part, 0 if static and one.begins else 1]
        pushes[active.index(one.normal)] -= one.sense * mu * C[one.tangent]
    z = np.zeros(len(right))
    if active:
        matrix = A[active] / lengths[active][:, None] @ (pushes / sizes[active][:, None]).T
        wanted = (right[active] / lengths[active]).tolist()
        forces, _, (rank, left, _) = solve_lists(matrix.tolist(), wanted, len(active), math.inf)
        if rank < len(active) or not left > DETERMINED:
            return None
        z[active] = np.array(forces) / sizes[active]
    for one in acting.slides:
        z[one.tangent] = -one.sense * known["coefficients"][one.part, 0 if static and one.begins else 1] * z[one.normal]
    x = pushes.T @ z[active]
    rows = list(switch.rows)
    terms = (np.abs(A) @ np.abs(x) + np.abs(right)) / lengths
    largest = float(np.linalg.norm(x)) + float(np.abs(right / lengths)[rows].max(initial=0.0))
    force = float(np.abs(z * sizes).max(initial=0.0)) + CLEAR_MOTION / CLEAR_BY * largest
    return Solved(z, (A @ x - right) / lengths, force, terms + CLEAR_MOTION / CLEAR_BY * largest)


def _lengths(rows: Floats) -> Floats:
    lengths = np.asarray(np.sqrt((rows * rows).sum(axis=1)), dtype=float)
    lengths[lengths == 0.0] = 1.0
    return lengths


def _hold_clearly(solved: Solved, facts: LawValues, acting: ActiveRows, free: int | None) -> bool:
    """Return whether all inequalities of what acts hold clearly but for those of the row `free`."""
    z, a, mu, sizes = solved.z, solved.a, facts.known["coefficients"], _lengths(facts.exerted.whole)
    forces = [(k, z[k] * sizes[k]) for k in acting.pressing]
    for stick in acting.sticks:
        left = room(mu[stick.part, 0], z[stick.normal], [z[stick.tangent]])
        forces.append((stick.tangent, sizes[stick.tangent] * left))
    ways = [(k, a[k]) for k in acting.apart]
    ways += [(slide.tangent, slide.sense * a[slide.tangent]) for slide in acting.slides if slide.begins]
    pressed = all(force > CLEAR_BY * solved.force for k, force in forces if k != free)
    return bool(pressed and all(way > CLEAR_BY * solved.terms[k] for k, way in ways if k != free))
