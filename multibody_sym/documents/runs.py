"""What a run came to, in a few lines."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any, Final

import numpy as np

from multibody_sym.documents.notes import redundancy_lines, shifts_text, withheld_text
from multibody_sym.motion.loop.problem import SEVERAL
from multibody_sym.motion.results.samples import EDGES_CROSS, ENERGY, NO_VALUE, PULLING, PUSHING, STAGE, TOO_FAR
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.program.runtime_constants import Status
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.parser import force_name
from multibody_sym.text.values import SI, Quantity, Units

_MOST_LINES: Final = 20
_LAST_LINES: Final = 5
_ALIKE: Final = 3
"""So many changes of a kind stand in one line."""
_MOST_NAMED: Final = 6
_GROWN: Final = 100
"""By how much errors of a run are larger than the tolerances of its steps; sensitive motions have more."""
_UNRESOLVED: Final = 1e-3
"""The part of a run's absolute tolerance that is told as nothing: the run does not tell it from zero."""
_ROUNDING: Final = 1e-14
"""The part of the largest kinetic energy that a sum of energies has from rounding."""
_TAKEN: Final = 1e-13
"""The part of the largest kinetic energy up to which what friction or impacts took in all is rounding, as _ROUNDING."""
_SINGULAR: Final = "singular position"


def run_summary(run: Trajectory, units: Units = SI) -> str:
    """Return how the run was done, where it ended, and how well energy and constraints were kept, in chosen units."""
    both = end_values(run)
    width = max((len(name) for each in both for name in each), default=0)
    asked, whole = ([f"  {name:{width}} {_end_text(x, units)}" for name, x in each.items()] for each in both)
    end = [f"at t = {_end_time(run, units)}:", *asked, *_shortened(whole)]  # all outputs, for they were asked for
    parts = run_parts(run, units) | {"end": end}
    order = ("method", "start", "end", "energy", "constraints", "withheld", "events", "remarks")
    return "\n".join(line for part in order for line in parts[part])


def run_parts(run: Trajectory, units: Units = SI) -> dict[str, list[str]]:
    """Return the lines on a run by their topics: all that `run_summary` says but the values at the end."""
    problem, taken, ready = run.problem, run.integration.statistics, run.ready
    accuracy = f"step {_time(problem.step, units)}" if problem.step else f"rtol {problem.rtol:g}, atol {problem.atol:g}"
    if problem.step and problem.step > problem.t_end - problem.t0:
        accuracy += ", longer than the run"
    code = {"c": "C", "python": "Python"}[ready.compiled.backend]
    done = "done" if run.stop is None else f"stopped by {run.stop['element']!r}"
    if run.integration.failure is not None:
        done = "interrupted" if run.interrupted else "failed"
    jacobians = f", {taken.jacobians} Jacobians" if taken.jacobians else ""
    ended, whole = _end_time(run, units), _time(problem.t_end, units)
    start = shifts_text(run.ready.shifts, run.ready.told.state_units, units)
    if run.stop is not None and run.stop["t"] <= run.problem.t0:
        start.append(f"the run ended at once: the condition of stop {run.stop['element']!r} holds at the start")
    untold = run.ready.told.untold
    return {
        "method": [
            f"{ready.told.name}: {done} at t = {ended} of {whole}, {len(run)} samples",
            (
                f"{problem.method.name} ({accuracy}), {ready.formalism} in {code}: {taken.steps} steps, "
                f"{taken.rejected} rejected, {taken.evaluations} evaluations{jacobians}"
            ),
        ],
        "start": start,
        "energy": _energy(run, units),
        "constraints": _constraints(run),
        "withheld": [
            *withheld_text(run.withheld, run.withheld_reasons),
            *([f"  outputs without a value for that: {', '.join(untold)}"] if untold else []),
        ],
        **_events(run, units),
    }


def _time(t: float, units: Units) -> str:
    return units.said(t, "s")


def _found_time(run: Trajectory, t: float, units: Units) -> str:
    """Return a time at which something happened: all times of a run have as many digits as its tolerance leaves."""
    if _is_nothing(run, t):
        return units.said(0.0, "s")
    known = 1.0 if run.problem.step else 2.0 * _GROWN * run.problem.rtol * 10.0**units.digits
    return units.said(t, "s", digits=max(1, units.digits - math.ceil(math.log10(max(known, 1.0)))))


def _end_time(run: Trajectory, units: Units) -> str:
    return _time(run.t_final, units) if run.stop is None else _found_time(run, run.t_final, units)


def end_values(run: Trajectory) -> tuple[dict[str, Quantity], dict[str, Quantity]]:
    """Return the outputs at the end of a run, and its state, by name, with their errors."""
    known = run.ready.told.state_units
    values: Mapping[str, float] = {**run.final["coordinates"], **run.final["speeds"]}
    errors = _end_errors(run, values, known)
    state = {
        name: Quantity(0.0 if _is_nothing(run, value) else value, known[name], errors.get(name, 0.0))
        for name, value in values.items()
    }
    # the outputs have the largest error of the state, relative to the largest value of the same name along the run
    courses: Mapping[str, Floats] = {**run.coordinates, **run.speeds}
    sizes = {name: float(np.max(np.abs(courses[name]), initial=0.0)) for name in errors}
    part = max((min(error / sizes[name], 1.0) for name, error in errors.items() if sizes[name]), default=0.0)
    outputs = {}
    for name, course in run.outputs.items():  # nan where one has no value
        value = float(course[-1]) if len(course) else math.nan
        told = 0.0 if _is_nothing(run, value) else value
        outputs[name] = Quantity(told, run.output_units[name], part * abs(told))
    return outputs, state


def _end_text(value: Quantity, units: Units) -> str:
    if not math.isfinite(value.number):
        return " no value"
    number = units.said(*value)
    return number if number[0] == "-" else f" {number}"


def _shortened(lines: Sequence[str]) -> list[str]:
    """Return the first and the last of many lines."""
    if len(lines) <= _MOST_LINES:
        return list(lines)
    first = _MOST_LINES - _LAST_LINES - 1
    return [*lines[:first], f"  ... {len(lines) - first - _LAST_LINES} more", *lines[-_LAST_LINES:]]


def _end_errors(run: Trajectory, values: Mapping[str, float], known: Mapping[str, str]) -> Mapping[str, float]:
    """Return by how much values at the end may be off, as a coarser run shows it; what that changes wholly is zero.

    Without such a run by the tolerances of steps, whose errors grow over a run; steps of a given length have none.
    """
    changes = run.end_changes
    if changes is not None:
        pairs = zip(values.items(), [*changes.q.tolist(), *changes.u.tolist()], strict=True)
        return {name: change if abs(value) <= change else changes.part * change for (name, value), change in pairs}
    if run.problem.step:
        return {}
    largest: dict[str, float] = {}
    for name, value in values.items():
        largest[known[name]] = max(largest.get(known[name], 0.0), abs(value))
    allowed = {unit: _GROWN * (run.problem.rtol * size + run.problem.atol) for unit, size in largest.items()}
    return {name: min(allowed[known[name]], abs(value) / 2) for name, value in values.items()}


def _is_nothing(run: Trajectory, value: float) -> bool:
    return not run.problem.step and abs(value) <= _UNRESOLVED * run.problem.atol


def _energy(run: Trajectory, units: Units) -> list[str]:
    if len(run.whole) == 0:
        return []
    begin = 0.0 if abs(run.energy_at_start) <= _ROUNDING * _largest_kinetic_energy(run) else run.energy_at_start
    closes = math.isfinite(run.energy_residual)
    account = _account(run, units) if closes else f"; {_change(run, units)}"
    lines = []
    for name, work in run.friction_work.items():
        bodies = _beyond_rounding(run, work.bodies)
        if bodies or _beyond_rounding(run, {name: work.total}):
            shares = [f"{units.said(x, 'J')} on {body}" for body, x in bodies.items()]
            parts = f" ({', '.join(shares)})" if len(shares) > 1 else ""
            lines.append(f"  work of friction at {name}: {units.said(work.total, 'J')}{parts}")
    lost = _beyond_rounding(run, run.impact_losses)
    lines += [f"  impact of {name} took {units.said(x, 'J')}" for name, x in lost.items()]
    return [f"total energy {units.said(begin, 'J')} at the start{account}", *_shortened(lines)]


def _largest_kinetic_energy(run: Trajectory) -> float:
    """Return the largest kinetic energy of the samples, 0 without one."""
    return float(np.nanmax(np.abs(run.whole.kinetic_energy), initial=0.0))


def _beyond_rounding(run: Trajectory, taken: Mapping[str, float]) -> dict[str, float]:
    """Return what was taken by name, without what is rounding beside the energy that moved."""
    least = _TAKEN * _largest_kinetic_energy(run)
    return {name: x for name, x in taken.items() if abs(x) > least}


def _change(run: Trajectory, units: Units) -> str:
    """Return by how much the energy changed, and what may have done it."""
    if run.ready.told.drives:
        drives = ", ".join(run.ready.told.drives)
        return f"prescribed motion ({drives}) does work, so that its change tells nothing about the integration"
    told = f"it changed by at most {units.said(run.drift['energy'], 'J', digits=2)}"
    rubbing = _beyond_rounding(run, {name: work.total for name, work in run.friction_work.items() if work.total < 0.0})
    lost = _beyond_rounding(run, run.impact_losses)
    acting = _first_names(list(dict.fromkeys((*run.ready.told.working, *rubbing, *lost))))
    return f"{told}, the work of {acting} included" if acting else told


def _account(run: Trajectory, units: Units) -> str:
    """Return the energy at the end, who took it or gave it, and what that leaves over."""
    assert run.modes is not None
    account = run.modes.account
    rubbing = _beyond_rounding(run, {name: work.total for name, work in account.friction.items()})
    lost, acting = _beyond_rounding(run, run.impact_losses), run.ready.told.working
    told = [f"friction took {units.said(-sum(rubbing.values()), 'J')} at {_first_names(rubbing)}"] if rubbing else []
    told += [f"impacts took {units.said(sum(lost.values()), 'J')} at {_first_names(lost)}"] if lost else []
    told += [f"the work of {_first_names(acting)} is {units.said(account.loads, 'J')}"] if acting else []
    left = f"the energy account closes to {units.said(abs(run.energy_residual), 'J', digits=2)}"
    return "; ".join([f", {units.said(float(run.whole.energy[-1]), 'J')} at the end", *told, left])


def _first_names(names: Collection[str]) -> str:
    """Return the first of some names and how many more there are."""
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(list(names)[:_MOST_NAMED]) + more


def _constraints(run: Trajectory) -> list[str]:
    drift, lines = run.drift, []
    if run.ready.told.rows:
        how = "projection after each step" if run.statistics["projection"] else "nothing"
        if run.problem.index_2:
            how = "equations of index 2"
        if run.baumgarte is not None and any(run.baumgarte.values()):
            how = "Baumgarte with alpha = {alpha:.4g}/s, beta = {beta:.4g}/s".format(**run.baumgarte)
        reached = f"|phi| <= {drift['position']:.2g}, |phidot| <= {drift['velocity']:.2g}"
        kept = "left, not kept" if run.integration.status is Status.LEFT else "kept"
        lines += [f"constraints {kept} by {how}: {reached}", *redundancy_lines(run.redundancy)]
    if drift["quaternion"]:
        lines.append(f"quaternions were within {drift['quaternion']:.2g} of unit length when they were normalised")
    return lines


def _events(run: Trajectory, units: Units) -> dict[str, list[str]]:
    """Return the stages, and what began to stick, slide, open or close; as remarks singular positions and warnings."""
    changes = [*run.begun, *run.changes]
    changed = ["changes of what holds one way only:", *_change_lines(run, changes, units)] if changes else []
    times = [_found_time(run, t, units).partition(" ")[0] for t in run.integration.singular]
    remarks = []
    if times:
        shown = ", ".join(times if len(times) <= _MOST_LINES else [*times[:_MOST_LINES], "..."])
        named = f"{len(times)} singular positions" if len(times) > 1 else "a singular position"
        depend = "in which constraints depend on each other"
        remarks.append(f"passed {named}, {depend}, at t = {shown} {units.of('s')}")
    events = run.events
    stages = [x for x in events if x["kind"] == STAGE]
    times_of_stages = [_found_time(run, x["t"], units) for x in stages]
    words = zip(times_of_stages, stages, strict=True)
    begun = [f"stage {k} begins at t = {when}: {x['element']}" for k, (when, x) in enumerate(words, 2)]
    told = [x for x in events if x != run.stop and x["kind"] not in (_SINGULAR, STAGE) and x not in changes]
    remarks += [_warning_text(x["kind"], x["element"], _found_time(run, x["t"], units)) for x in told]
    return {"events": [*begun, *changed], "remarks": remarks}


def _change_lines(run: Trajectory, changes: Sequence[Mapping[str, Any]], units: Units) -> list[str]:
    """Return a line for each change; successive changes alike stand in one, of very many all that are alike."""
    several = f"one of {SEVERAL}: the laws leave several motions, and nothing says which one happens"
    kinds = [f"{x['taken']}, {several}" if x["kind"] == SEVERAL else x["kind"] for x in changes]
    named = [(f"{x['element']} {kind}", x["t"]) for x, kind in zip(changes, kinds, strict=True)]
    successive = [(words, [t for _, t in each]) for words, each in groupby(named, key=itemgetter(0))]
    if len(successive) > _MOST_LINES:
        alike: dict[str, list[float]] = {}
        for words, t in named[:-1]:
            alike.setdefault(words, []).append(t)
        successive = [*alike.items(), (named[-1][0], [named[-1][1]])]
    lines: list[str] = []
    for words, times in successive:
        told = [_found_time(run, t, units) for t in times]
        if len(times) < _ALIKE:
            lines += [f"  t = {t}: {words}" for t in told]
        else:
            lines.append(f"  t = {told[0]} to {told[-1]}: {words}, {len(times)} times")
    return _shortened(lines)


def _warning_text(kind: str, element: str, t: str) -> str:
    if kind.endswith("limit"):
        return f"warning: joint {element} passes its {kind} at t = {t}; nothing stops it there"
    said = {
        PUSHING: f"from t = {t} on rope {element} would have to push; a real one goes slack there",
        PULLING: f"from t = {t} on {force_name(element, 'multiplier')} is negative: the plane would have to pull; a "
        "real wheel lifts off",
        EDGES_CROSS: f"at t = {t} an edge of one box of contact {element} leads through the other: corners and faces "
        "touch, edges only where a contact names both (between: [a.bottom_front, b.top_right])",
        NO_VALUE: f"output {element} has no finite value, at t = {t} for the first time",
        ENERGY: f"from t = {t} on the energy grows from nowhere: steps that are too long, or what drives what it "
        "should brake (a negative damping, mass or stiffness); try a tighter tolerance or shorter steps first",
        TOO_FAR: f"coordinate {element} is so large, from t = {t} on, that it moves by less than its own spacing (the "
        "way to the next float) in a step, and may stand still: let it start nearer to 0",
    }
    return f"warning: {said[kind]}"
