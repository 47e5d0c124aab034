"""The impact at the start of a system: the elements that strike, the impulses, and the system after it, in floats."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final, cast

import numpy as np

from multibody_sym.contact_laws.impact_problem import ImpactLaw, ImpactProblem, ImpactResult, Order
from multibody_sym.dynamics.contact.contact_problem import OneWayRows
from multibody_sym.dynamics.contact.impact_problem import Blow, friction_parts, pose, struck_rows
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.initial_geometry import SignedLength, fix_directions
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.parameters import value_at, verify_friction, verify_lengths
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import closed_at, rows_at
from multibody_sym.errors import ModelError, NoSolutionError, Where, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.impacts import state_in_impact
from multibody_sym.mechanics.law_elements import MEETING, LawElement, MeetingRow, StruckImpacts
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.points import direction, position
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON
from multibody_sym.scalars.elementary import leaves

_MET: Final = 1e-9
"""The part of the model's size up to which points meet and what begins closes, as for contacts (LAWS.md, 3)."""
_ROUNDING: Final = 16.0 * EPSILON
"""The part of the largest speed that rounding leaves of one that vanishes."""


@dataclass(frozen=True, eq=False)
class PosedImpact:
    """An impact at the start: the `mechanism` before (without rows that begin), its start, and the impact's setup.

    `coefficients`: the restitution of each element, normal and tangential. `law` and `order` as asked or by default:
    Newton's law without friction, one by one where an element bounces.
    """

    system: System
    mechanism: Mechanism
    begin: Start
    sides: tuple[SignedLength, ...]
    blow: Blow
    law: ImpactLaw
    order: Order
    coefficients: Mapping[str, tuple[float, float]]
    scale: float

    @property
    def problem(self) -> ImpactProblem:
        return pose(self.blow, self.law, self.order, self.coefficients)


def verify_declared(system: System) -> None:
    """Raise ModelError where a system has no impact."""
    if system.impact is None:
        raise ModelError("nothing strikes: the system has no impact; declare one (impact=...)", number="M121")


def posed_impact(system: System) -> PosedImpact:
    """Return the impact at the start of a system.

    Raises ModelError for what does not touch or has impossible coefficients, or where no impact is declared, and
    NoSolutionError where nothing strikes.
    """
    verify_declared(system)
    resolved = check_numbers(system)
    declared = resolved.relative or resolved
    impact = declared.impact
    assert impact is not None
    before = without(declared, impact)
    begin = start(before, project=system.simulation.project)
    _, begin = closed_at(before, begin, project=system.simulation.project)
    straight, sides = fix_directions(declared, begin.q, begin.u, begin.parameters)
    state = state_of(straight, float, 0.0, begin.q, begin.u, begin.parameters)
    verify_lengths(motion_of(straight, state))
    rows = rows_at(straight, begin)
    elements = _elements(straight, impact, rows)
    blow = Blow(straight, state, impact, tuple(elements))
    _verify_met(blow, rows.scale.length)
    _verify_begun(blow, rows.scale.length)
    _verify_strikes(blow, rows)
    coefficients = {x.name: coefficients_of(blow, x) for x in elements}
    law = cast(ImpactLaw, impact.law or ("poisson" if blow.rough or any(map(friction_parts, elements)) else "newton"))
    bounces = any(e > 0.0 for e, _ in coefficients.values())
    order = cast(Order, impact.sequence or ("one_by_one" if bounces else "simultaneous"))
    return PosedImpact(
        system, without(straight, impact), begin, sides, blow, law, order, coefficients, rows.scale.length
    )


def without(mechanism: Mechanism, impact: StruckImpacts) -> Mechanism:
    """Return the mechanism before an impact: without the rows that begin to hold with it."""
    begun = {name for names in impact.begins.values() for name in names}
    if not begun:
        return mechanism
    kept = [row for row in mechanism.rows if row.name not in begun]
    places = {row.name: k for k, row in enumerate(kept)}
    cuts = []
    for cut in mechanism.cuts:
        if cut.name in impact.begins:
            continue
        names = [mechanism.rows[k].name for k in cut.rows]
        first = places[names[0]] if names else 0
        drives = tuple(
            replace(x, row=places[mechanism.rows[x.row].name])
            for x in cut.drives
            if mechanism.rows[x.row].name in places
        )
        teeth = tuple((places[mechanism.rows[k].name], f) for k, f in cut.teeth if mechanism.rows[k].name in places)
        cuts.append(replace(cut, rows=range(first, first + len(names)), drives=drives, teeth=teeth))
    return replace(mechanism, rows=tuple(kept), cuts=tuple(cuts))


# --- what takes part -----------------------------------------------------------------------------------------------


def _elements(mechanism: Mechanism, impact: StruckImpacts, rows: OneWayRows) -> list[LawElement]:
    """Return the elements that touch and may strike, with the coefficients that the section `impact` gives them."""
    found = list(impact.meetings)
    named, touching = impact.contacts, rows.touching()
    for element in mechanism.one_way:
        if not element.unilateral:
            continue
        if named is not None and {element.name, element.group}.isdisjoint(named):
            continue
        if element.name in touching:
            for name in (element.group, element.name):
                if name in impact.restitutions:
                    element = replace(element, restitution=impact.restitutions[name])
                if name in impact.tangential:
                    element = replace(element, tangential_restitution=impact.tangential[name])
            found.append(element)
        elif element.name in (named or ()) and rows.standing(element) == "open":
            gap = rows.gap(element)
            raise ModelError(
                f"{element.name} is open by {gap:.4g} and strikes nothing; start it where it touches",
                where=Where(path=element.path),
                number="M121",
            )
    return found


def coefficients_of(blow: Blow, element: LawElement) -> tuple[float, float]:
    """Return both coefficients of restitution of an element; raises ModelError for impossible ones."""
    words = "restitution", "tangential_restitution"
    values = blow.state.values([element.restitution, element.tangential_restitution])
    for word, value in zip(words, values, strict=True):
        if not 0.0 <= value <= 1.0:
            raise ModelError(
                f"the {word} of {element.name} is {value:.6g}; it is between 0 (they stay together) and 1 (nothing is "
                "lost)",
                where=Where(path=(*blow.impact.paths.get(element.name, element.path), word)),
                number="M109",
            )
    with at(*blow.impact.paths.get(element.name, element.path)):
        for part in element.frictions:
            verify_friction(part, partial(value_at, blow.motion))
    return float(values[0]), float(values[1])


# --- what is wrong -------------------------------------------------------------------------------------------------


def _verify_met(blow: Blow, size: float) -> None:
    """Raise ModelError for points without a normal, or that are apart across it."""
    for element in blow.impact.meetings:
        row, path = element.normals[0], blow.impact.paths[element.name]
        assert isinstance(row, MeetingRow)
        first, second = (np.array(position(blow.motion, end), dtype=float) for end in row.ends)
        met = [leaf for leaf in leaves(row.axis, "slot") if leaf.data[0] == MEETING]
        if met and not any(blow.motion.state.slots[leaf] for leaf in met):
            raise ModelError(
                f"the points of {element.name} do not move relative to each other, and no normal is given; write "
                "normal: [x, y, z], from the second to the first",
                where=Where(path=path),
                number="M121",
            )
        apart, n = first - second, np.array(direction(blow.motion, row.frame, row.axis), dtype=float)
        across = float(np.linalg.norm(apart - n * (n @ apart)))
        if across > _MET * size:
            raise ModelError(
                f"{row.ends[0].name} is {across:.4g} m beside {row.ends[1].name}, across the normal: their impulses "
                "would make a couple. Start where the points meet, or name the points that do",
                where=Where(path=(*path, "between")),
                number="M121",
            )


def _verify_begun(blow: Blow, size: float) -> None:
    for owner, names in blow.impact.begins.items():
        missed = [
            (abs(float(row.gap)), name) for row, name in zip(blow.rows, blow.names, strict=True) if name in names
        ]
        most, name = max(missed, default=(0.0, ""))
        if most > _MET * max(size, 1.0):
            raise ModelError(
                f"{owner} cannot begin here: {name} is missed by {most:.4g}; start where it closes",
                where=Where(path=blow.impact.paths.get(owner, ("impact",))),
                number="M121",
            )


def _verify_strikes(blow: Blow, rows: OneWayRows) -> None:
    """Raise NoSolutionError where all elements that touch separate."""
    impact = blow.impact
    if impact.loads or impact.begins or impact.jumps:
        return
    rates = {x.name: _opening_speed(blow, x) for x in blow.elements}
    rates |= {x.name: rows.rate(x) for x in rows.mechanism.one_way if x.unilateral and rows.standing(x) == "leaving"}
    if not rates:
        raise NoSolutionError(
            "nothing strikes: no contact, rope or stop is closed at the start; start where it touches, or write "
            "between: [a, b] with a normal, or an impulse",
            where=Where(path=("impact",)),
            number="N108",
        )
    if min(rates.values()) >= 0.0:
        words = (f"{name} opens with {v:.4g} m/s" if v else f"{name} touches and rests" for name, v in rates.items())
        first = next(iter(rates))
        cure = (
            "The velocity of the first relative to the second is to lead against the normal, which points from the "
            "second to the first"
            if first in (x.name for x in impact.meetings)
            else "Start with speeds at which it closes"
        )
        raise NoSolutionError(
            f"nothing strikes: {', '.join(words)}. {cure}",
            where=Where(path=impact.paths.get(first, ("impact",))),
            number="N108",
        )


def _opening_speed(blow: Blow, element: LawElement) -> float:
    return float(blow.rows[blow.names.index(element.normals[0].name)].phidot)


def outcome(posed: PosedImpact) -> ImpactResult:
    """Return the impulses and speeds of the impact. Raises NoSolutionError where its laws have no solution."""
    closing = [x for x in posed.blow.elements if float(_opening_speed(posed.blow, x)) < 0.0]
    if posed.law == "stronge" and posed.order == "simultaneous" and len(closing) > 1:
        raise ModelError(
            f"{', '.join(x.name for x in closing)} close together, and Stronge's coefficient is that of one contact; "
            "write sequence: one_by_one, or law: poisson",
            where=Where(path=("impact", "law")),
            number="M121",
        )
    from multibody_sym.contact_laws.impact_sequence import strike  # which few systems need

    try:
        return strike(posed.problem)
    except NoSolutionError as error:
        raise NoSolutionError(error.message, where=Where(path=("impact",)), number=error.number) from None


@dataclass(frozen=True)
class FromImpact:
    """A system without its impact, with the `speeds` after it at the start; `events` as of runs, one an element."""

    system: System
    speeds: Mapping[str, float]
    events: tuple[Mapping[str, Any], ...]


def from_impact(system: System) -> FromImpact:
    """Return the system after its impact.

    Raises what `posed_impact` and `outcome` do, and ModelError for motions whose rates jump.
    """
    posed = posed_impact(system)
    if posed.blow.impact.jumps:
        raise ModelError(
            "a run does not go on from a prescribed motion whose speed jumps; write the motion as it is afterwards",
            where=Where(path=("impact",)),
            number="M121",
        )
    struck = outcome(posed)
    rows = struck_rows(posed.blow, struck)
    dynamics = tree_dynamics_of(rows.mechanism, state_in_impact(posed.blow.motion.state, rows.jumps))
    jumps, places = forward_dynamics(dynamics).udot, posed.blow.places
    before, units = np.array(posed.begin.u, dtype=float), [speed.unit for speed in posed.mechanism.speeds]
    sizes = np.maximum(np.abs(before), np.abs(jumps))
    largest = {unit: max(x for x, own in zip(sizes, units, strict=True) if own == unit) for unit in units}
    after = {
        speed.name: u if abs(u) > _ROUNDING * largest[speed.unit] else 0.0
        for speed, u in zip(posed.mechanism.speeds, (before + jumps).tolist(), strict=True)
    }
    events: list[dict[str, Any]] = []
    for element in rows.acting:
        own = [places[row.name] for row in element.rows if row.name in places]
        impulse, lost = float(struck.impulses[places[element.normals[0].name]]), float(struck.lost[own].sum())
        events.append({"t": 0.0, "kind": "impact", "element": element.name, "impulse": impulse, "lost": lost})
    for name, begun in posed.blow.impact.begins.items():
        lost = float(struck.lost[[places[row] for row in begun]].sum())
        events.append({"t": 0.0, "kind": "impact", "element": name, "lost": lost})
    return FromImpact(Overrides(initial=after).of(replace(system, impact=None)), after, tuple(events))
