"""Why a run ended early, in the names of the model; runs that leave their constraints beside the size of the model."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.dynamics.closing import ConstraintRows, Residual
from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import composite_body, mass_diagonal
from multibody_sym.dynamics.programs.reactions import ropes
from multibody_sym.dynamics.redundancy import contradiction_of, nearly_dependent
from multibody_sym.dynamics.start.parameters import undefined_text, value_or_none
from multibody_sym.errors import InputError
from multibody_sym.mechanics.contact_geometry import ON_POINTS, fits, flat_rims
from multibody_sym.mechanics.forces import apart, applied_forces, applied_generalized_forces, varies
from multibody_sym.mechanics.mechanism import TIME, Mechanism, Source
from multibody_sym.mechanics.motion import Motion, state_of, why_locked
from multibody_sym.mechanics.row_records import Marker, VelocityRow
from multibody_sym.model.bodies import GROUND, used_up
from multibody_sym.model.system import expressions_in
from multibody_sym.motion.integrator.flow import Flow, StepError
from multibody_sym.motion.integrator.loop import first_step, least_step
from multibody_sym.motion.loop.integrate import Integration
from multibody_sym.motion.loop.problem import Problem, Reason, RunFailure
from multibody_sym.motion.methods.multistep import Collocation
from multibody_sym.program.runtime_constants import Status
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, slot, symbol

if TYPE_CHECKING:
    from multibody_sym.motion.results.trajectory import Trajectory


# ----------------------------------------------------------------------------------------------------------------------
# Whether stiffness keeps the steps of a run short: how fast its motion swings or dies down where it ended.


_SHORT: Final = 0.005
"""Steps of a run that follow a swing are longer than this part of 1/omega, at the least tolerances too."""
_OFTEN: Final = 1e4
"""How often in a run what is stiff could swing (by radians) or die down."""
_MOST: Final = 200
"""The largest state whose rates are differenced."""
_BESIDE: Final = (1e-6, 1e-7)
"""How far beside a state its rates are taken, as a part of its size: smooth ones have the same slope by both."""
_SMOOTH: Final = 0.01
_CURE: Final = "look at the value and the unit of what is so stiff"


def stiffness_of(run: Trajectory, time: float) -> str:
    """Return what is so stiff that it keeps steps short at the end of a run, and what to do; empty if nothing is."""
    steps = run.integration.statistics.steps
    found = _fastest(run, time)
    if found is None or not steps:
        return ""
    (value, name), span = found, run.problem.t_end - run.problem.t0
    if abs(value) * (time - run.problem.t0) < _SHORT * steps or abs(value) * span < _OFTEN:
        return ""
    if abs(value.imag) >= abs(value.real):
        swings = abs(value.imag) * span / (2.0 * math.pi)
        return (
            f"{name} is stiff, it swings with omega = {abs(value.imag):.3g} rad/s there, {swings:.3g} times in the "
            f"run, and every swing takes steps; {_CURE}; where its swings do not matter hold it by a joint or "
            "constraint, or damp it and take an implicit method (method: radau_5)"
        )
    if isinstance(run.problem.method, Collocation) or value.real > 0.0:
        return ""
    return (
        f"{name} is stiff, it dies down within {1.0 / abs(value.real):.3g} s there, and {run.problem.method.name} "
        f"takes steps as short as that; take an implicit method (method: radau_5), or {_CURE}"
    )


def _fastest(run: Trajectory, time: float) -> tuple[complex, str] | None:
    """Return the largest eigenvalue (1/s) of the motion beside the end of a run, and the coordinate with most of it.

    None where the rates are not smooth there, or have no values.
    """
    x = _final(run)
    if not 0 < len(x) <= _MOST:
        return None
    size = np.where(np.abs(x) > 0.0, np.abs(x), 1.0)
    slopes: list[Floats] = []
    try:
        for part in _BESIDE:  # how the rates follow the state, by differences
            columns = [
                (_rates(run, time, x + part * size[k] * e) - _rates(run, time, x - part * size[k] * e))
                / (2 * part * size[k])
                for k, e in enumerate(np.eye(len(x)))
            ]
            slopes.append(np.stack(columns, axis=1))
    except UNDEFINED:
        return None
    if not all(np.isfinite(slope).all() for slope in slopes):
        return None
    sizes = [float(np.linalg.norm(slope)) for slope in slopes]
    if abs(sizes[0] - sizes[1]) > _SMOOTH * max(sizes):
        return None
    values, vectors = np.linalg.eig(slopes[0])
    k = int(np.argmax(np.abs(values)))
    coordinates = run.ready.mechanism.coordinates
    return complex(values[k]), coordinates[int(np.argmax(np.abs(vectors[: len(coordinates), k])))].name


def _rates(run: Trajectory, t: float, x: Floats) -> Floats:
    """Return the rates of a state (n,)."""
    return _last_problem(run).rates(t, x)


def _last_problem(run: Trajectory) -> Problem:
    """Return the problem in which a run ended, that of its last mode where it has some."""
    return run.modes.legs[-1].problem if run.modes and run.modes.legs else run.problem


def _final(run: Trajectory) -> Floats:
    """Return the state (nq + nu,) in which a run ended."""
    return np.concatenate([run.integration.q_final, run.integration.u_final])


def _first_and_last(run: Trajectory, time: float) -> tuple[Motion, Motion]:
    """Return the motion at the start of a run and at its end, without rows that act."""
    rows, end = ConstraintRows(run.ready.mechanism, run.parameters.tolist(), [], time), run.integration
    return rows.motion(run.ready.q0, run.ready.u0), rows.motion(end.q_final, end.u_final)


_BROKEN: Final = (Status.NOT_CLOSED, Status.CONTRADICTION, Status.LEFT)
"""A constraint row is broken."""
_OF_MODE: Final = (Status.NOT_CLOSED, Status.CONTRADICTION)
"""One of those of the mode in which the run ended."""
_STEP_TOO_LONG: Final = (Status.STEP_UNDERFLOW, Status.NOT_FINITE, Status.NOT_CONVERGED)
"""What too long a step may end in."""
_OF_STEPS: Final = (*_STEP_TOO_LONG, Status.NO_SLOPE, Status.STEP_LIMIT, Status.CHATTERS)
"""No further step was taken, and no row is at fault."""
_LEFT: Final = 1e-3
"""The part of a row's size, as `Missed` has it, by which a run that keeps it never misses it."""
_TIGHT: Final = 0.9
"""The part of a radius of curvature from which a wheel in a hollow is what a run fails on."""
_SUDDEN: Final = 1e-6
"""The part of a run's time within which a speed that grows without bound doubles where the run fails."""
_GROWN: Final = 1e3
"""By how much it is then above the mean speed since the start."""
_IN_A_RADIAN: Final = 100
"""Steps in which the dearest method follows a radian of what turns."""
_FEW: Final = 100
"""Least steps of a run, within which a step of the motion is too near to them."""
_MEETS: Final = 1e-3
"""The part of a distance at the start below which points meet where a run fails."""
_USED_UP: Final = 1e-2
"""The part of a mass at the start below which it is why a run failed: there its acceleration grows without bound."""
_APART: Final = 0.1
"""Independence of rows above which they are far from a singular position."""
_WHY_FAILED_BESIDE: Final = (1e-5, 1e-7)
"""How far beside a speed, as a part of the largest one, accelerations are compared."""
_KEPT: Final = 0.5
"""The part of their change that is left so near if they jump."""
_VANISHED: Final = 1e-6
"""The part of the inertia along a speed at the start of a run that is next to nothing."""
_NEXT: Final = (0.0, 1e-12, 1e-9, 1e-6)
"""Parts of a run's time after its end at which inputs are looked at, which may have a value up to there."""
_BEHIND: Final = (0.0, 1e-9, 1e-6, 1e-4)
"""Parts of a run's time behind its end at which expressions are evaluated that may have no value there."""
_SIZED: Final = 20
"""Samples of a run at which sizes of rows are looked at."""

_NO_CAUSE: Final = (
    "its cause was not found: "
    "no points of a force or a rope meet, no angles lock, no inertia vanishes, no speed grows without bound there"
)


def why_failed(run: Trajectory, failure: RunFailure) -> Reason:
    """Return what happened, to which coordinate, speed or constraint, when, and what to do."""
    failure, mechanism = _in_rows_of_its_mode(run, failure), run.ready.mechanism
    if any(body.is_foot for body in mechanism.bodies):
        # a body in a hollow that bends as much as it does itself stays there
        _, motion = _first_and_last(run, failure.time)
        normals = [row for element in mechanism.one_way for row in element.normals]
        for fit in fits(motion, (*mechanism.rows, *normals)):
            if fit.ratio > _TIGHT:
                at = f"at t = {failure.time:.6g} s"
                return Reason(f"{at} {fit.text}, and what goes on from there is not told; {fit.advice}")
    if failure.status in _OF_STEPS:
        return _step_failed(run, failure)
    if failure.status is Status.SINGULAR:
        return _singular(run, failure.time)
    when = f"at t = {failure.time:.6g} s"
    if failure.status is Status.NO_MODE:
        assert failure.reason is not None
        return replace(failure.reason, text=f"{failure.reason.text} {when}")
    assert failure.status in _BROKEN
    entered, parameters = _ended_in(run)
    rows = ConstraintRows(entered, parameters, range(len(entered.rows)), failure.time)
    generic = entered.parameters.independent_rows(parameters)
    found = contradiction_of(rows, run.integration.q_final, run.integration.u_final, generic)
    if found is not None:
        return Reason(found.message(entered, when), ends=True)
    left = failure.status is Status.LEFT
    what = "the state"
    if failure.component is not None:
        what = (mechanism if left else entered).rows[failure.component].name
    if left:
        return Reason(
            f"constraint {what} is missed {when} by more than a thousandth of the model's size: the method has lost "
            "the motion; take shorter steps or tolerances, or projection with one of this package's methods"
        )
    return _not_satisfied(run, failure, f"constraint {what} cannot be satisfied {when}")


def _cause(run: Trajectory, time: float) -> str | None:
    """Return why forces or speeds grow without bound, as where points meet or angles lock; None for nothing found."""
    first, last = _first_and_last(run, time)
    return (
        _met(_point_lines(run.ready.mechanism), first, last)
        or _lies_flat(run, last)
        or _gimbal_lock(last)
        or _in_line(first, last)
        or _about_nothing(first, last)
        or _growing_speed(run, time, last)
        or _growing_state(run, time)
        or _load_grown(run, time, last)
    )


def _point_lines(mechanism: Mechanism) -> list[tuple[str, tuple[Marker, Marker]]]:
    """Return what acts along lines between points, by name."""
    lines = [(load.name, load.line) for load in mechanism.loads if load.line is not None]
    active = (row.rope_run for row in mechanism.rows if row.rope_run is not None)
    return [*lines, *((rope.name, ends) for rope in active for ends in pairwise(rope.points))]


def _met(lines: Iterable[tuple[str, tuple[Marker, Marker]]], first: Motion, last: Motion) -> str | None:
    """Return that two points meet at the end of a run between which something is stretched; None for nothing."""
    for name, ends in lines:
        begun, now = (math.hypot(*apart(motion, ends)) for motion in (first, last))
        if now <= _MEETS * begun:
            a, b = ends
            return f"{a.name} and {b.name} meet there, and {name} between them has neither direction nor bound"
    return None


def _load_grown(run: Trajectory, time: float, last: Motion) -> str | None:
    """Return which load grows without bound at the end of a run and not as the motion does, as by a pole in time.

    None for none, or where it has no value there.
    """
    mechanism, t0 = run.ready.mechanism, run.problem.t0
    half = int(np.searchsorted(run.t, (t0 + time) / 2.0))
    if not 0 < half < len(run.t):
        return None
    rows = ConstraintRows(mechanism, run.parameters.tolist(), [], float(run.t[half]))
    middle = rows.motion(run.q[half], run.u[half])
    sizes = [max(map(abs, (*motion.state.q, *motion.state.u)), default=0.0) for motion in (middle, last)]
    if sizes[1] > _GROWN * sizes[0]:
        return None
    for load in mechanism.loads:
        try:
            before, now = (
                max(
                    map(abs, applied_generalized_forces(motion, applied_forces(motion, [load], weight=False))),
                    default=0.0,
                )
                for motion in (middle, last)
            )
        except (*UNDEFINED, InputError):
            return None
        if 0.0 < before <= _SUDDEN * now:
            return f"{load.name} grows without bound there, as its expression does; bound it, or end the run before"
    return None


def _lies_flat(run: Trajectory, last: Motion) -> str | None:
    """Return that a rim that touches comes to lie flat at the end of a run: its lowest point goes around at once."""
    active = run.modes.legs[-1].active if run.modes is not None and run.modes.legs else ()
    normals = (x.normals[0] for x in last.mechanism.one_way if x.name in active)
    told = next(flat_rims((*last.mechanism.rows, *normals), last), None)
    return told and f"{told}; {ON_POINTS}, or end the run before"


def _gimbal_lock(last: Motion) -> str | None:
    """Return that the first and the third angle of a body have one axis at the end of a run; None for nothing."""
    turned = (why_locked(last, place) for place in range(len(last.mechanism.bodies)))
    return next((told for told in turned if told), None)


def _in_line(first: Motion, last: Motion) -> str | None:
    """Return that massless bodies have come into line, so that next to nothing resists a speed; None for nothing."""
    mechanism = last.mechanism
    declared = (body for body in mechanism.bodies if not (body.is_double or body.is_foot))
    massless = [body.name for body in declared if body.mass.mass is ZERO and body.name != GROUND]
    if not massless:
        return None
    try:
        begun, left = _resisting_shares(first), _resisting_shares(last)
    except ZeroDivisionError:  # what rows alone hold
        return None
    place = int(np.argmin(left))
    if left[place] > _VANISHED * begun[place]:
        return None
    speed, bodies = mechanism.speeds[place], " and ".join(massless)
    return (
        f"next to nothing resists {speed.name} there, which grows without bound: {bodies}, without mass, come into "
        "line with what they join; give one of them a mass, or end the run before"
    )


def _about_nothing(first: Motion, last: Motion) -> str | None:
    """Return that what a joint turns has come onto its axis, so that it has next to no inertia; None for nothing."""
    speeds = last.mechanism.speeds
    if any(body.mass.mass is ZERO for body in last.mechanism.bodies if body.name != GROUND):
        return None
    begun, left = _pivots(first), _pivots(last)
    vanished = [k for k, speed in enumerate(speeds) if speed.unit == "rad/s" and left[k] <= _VANISHED * begun[k]]
    if not vanished:
        return None
    return (
        f"next to nothing resists {speeds[vanished[0]].name} there: masses that it turns have come onto its axis, "
        "and have no inertia about it; give a body one (inertia: ..), or end the run before"
    )


def _resisting_shares(motion: Motion) -> Floats:
    """Return (nu) which part of the inertia along each speed is left while all speeds before it are free."""
    return np.asarray(_pivots(motion) / np.array([float(x) for x in mass_diagonal(motion)]), dtype=float)


def _pivots(motion: Motion) -> Floats:
    """Return (nu) the inertia along each speed while all speeds before it are free."""
    pivots = list(map(float, tree_factors(motion).pivots))
    return np.array(pivots, dtype=float)


def _growing_speed(run: Trajectory, time: float, last: Motion) -> str | None:
    """Return which speed grows without bound at the end of a run, and which load drives it; None for none."""
    mechanism, begun, end = run.ready.mechanism, run.problem, run.integration
    q, u, gone = end.q_final, end.u_final, time - begun.t0
    if not len(u) or gone <= 0.0:
        return None
    rates = _rates(run, time, _final(run))[len(q) :]
    k = int(np.argmax(np.abs(u)))
    doubling = u[k] / rates[k] if rates[k] else np.inf
    if not 0.0 < doubling < _SUDDEN * gone or abs(u[k]) * gone < _GROWN * np.abs(q - begun.q0).max():
        return None
    powers = {
        load.name: float(np.dot(u, applied_generalized_forces(last, applied_forces(last, [load], weight=False))))
        for load in mechanism.loads
    }
    most = max(powers, key=lambda name: powers[name], default=None)
    cause = f"{most} drives it: look for a wrong sign there, or " if most and powers[most] > 0.0 else ""
    speed = mechanism.speeds[k]
    return (
        f"{speed.name} grows without bound there: it is {u[k]:.3g} {speed.unit}, and doubles within {doubling:.1g} s; "
        f"{cause}end the run before"
    )


def _growing_state(run: Trajectory, time: float) -> str | None:
    """Return which declared state grows without bound at the end of a run; None for none."""
    end, gone = run.integration, time - run.problem.t0
    rates = _rates(run, end.t_final, _final(run))
    for k, coordinate in enumerate(run.ready.mechanism.coordinates):
        x, before = end.q_final[k], run.problem.q0[k]
        grows = gone > 0.0 and x * rates[k] > 0.0 and x / rates[k] < _SUDDEN * gone
        if coordinate.name in run.ready.system.states and grows and abs(x) > _GROWN * abs(before):
            told = f"{coordinate.name} grows without bound there: it is {x:.3g}, and doubles within"
            cure = f"look for a wrong sign in states.{coordinate.name}.rate, or end the run before"
            return f"{told} {x / rates[k]:.1g} s; {cure}"
    return None


def _turns_fast(run: Trajectory, time: float, last: Motion) -> str | None:
    """Return which joint or body turns so fast that its turns take most of the steps of a run; None for none."""
    end, gone = run.integration, time - run.problem.t0
    turning = [
        (abs(u), u, speed.name)
        for speed, u in zip(last.mechanism.speeds, end.u_final.tolist(), strict=True)
        if speed.unit == "rad/s"
    ]
    size, u, name = max(turning, default=(0.0, 0.0, ""))
    if size * gone < max(end.statistics.steps / _IN_A_RADIAN, _GROWN):
        return None
    return f"{name} is {u:.3g} rad/s there, and its turns take the steps; look at what drives it, or end the run before"


def _step_failed(run: Trajectory, failure: RunFailure) -> Reason:
    """Return why a method took no further step, where no row is at fault."""
    problem, when, index = run.problem, f"at t = {failure.time:.6g} s", failure.component
    what = "the state"
    if index is not None:
        mechanism = _ended_in(run)[0]
        what = [*(each.name for each in mechanism.coordinates), *(each.name for each in mechanism.speeds)][index]
    if failure.status in _STEP_TOO_LONG and _is_too_long(problem, failure.time):
        return Reason(
            f"the run is too long for the steps that the motion needs: floats tell no steps so short apart in "
            f"{problem.t_end:.3g} s; it got no further than t = {failure.time:.6g} s; ask for a shorter time"
        )
    if failure.status is Status.NOT_FINITE:
        why = _not_finite(run, failure.time)
        rate = what if index is None else f"the rate of {what} is no finite number"
        return replace(why, text=f"{rate} {when}: {why.text}")
    if failure.status is Status.NO_SLOPE:
        return Reason(
            f"the rate of {what} has no finite derivative {when}, which {problem.method.name} needs: an expression, "
            "such as a root at zero, rises without bound there; take an explicit method, or bound its slope"
        )
    if failure.status is Status.STEP_UNDERFLOW and index is None:
        return Reason(
            f"{problem.method.name} takes no further step {when}, and does not say why: the motion has a jump or a "
            "singularity there, or the method does not fit it; take other tolerances, or one of this package's methods"
        )
    if failure.status is Status.STEP_UNDERFLOW:
        cause = _cause(run, failure.time)
        text = f"the step became too small {when}, on account of {what}: {cause or _NO_CAUSE}"
        return Reason(text, ends=cause is not None)
    if failure.status is Status.NOT_CONVERGED:
        advice = "take shorter steps, or tolerances; if that does not help the motion has a jump or a singularity there"
        return Reason(f"Newton's iteration for the step does not converge {when}, on account of {what}: {advice}")
    taken, most = run.integration.statistics.steps, problem.max_steps
    if failure.status is Status.CHATTERS:
        got = "the run gets"
    elif taken >= most:
        got = "the run took its largest number of steps and got"
    else:
        got = (
            f"the run takes ever more steps, {taken} by now, by which it would take over {most:.0e} "
            f"to t = {problem.t_end:.6g} s; it got"
        )
    return Reason(f"{got} no further than t = {failure.time:.6g} s: {_advice_on_steps(run, failure.time)}")


def _not_satisfied(run: Trajectory, failure: RunFailure, told: str) -> Reason:
    """Return why a constraint cannot be satisfied, beside what is `told`."""
    mechanism = _ended_in(run)[0]
    row = mechanism.rows[failure.component] if failure.component is not None else None
    if row is not None and row.rope_run is not None:
        first, last = _first_and_last(run, failure.time)
        if met := _met([(row.name, ends) for ends in pairwise(row.points)], first, last):
            return Reason(f"{told}: {met}; end the run before", ends=True)
    if isinstance(row, VelocityRow):
        named = {leaf.data[1] for leaf in leaves([row.zero], "slot") if leaf.data[0] == "u"}
        names = [speed.name for k, speed in enumerate(mechanism.speeds) if k in named]
        return Reason(
            f"{told}: it acts on every speed that it names ({', '.join(names)}), as all constraints do, and the forces "
            "that this takes grow beyond what a step can follow; it is no equation of a state of its own"
        )
    return Reason(
        f"{told}: no position beyond was found that satisfies it, down to the shortest step; this is where lengths end "
        "the motion, or where the method has lost it: shorter steps or tolerances tell"
    )


def _not_finite(run: Trajectory, time: float) -> Reason:
    """Return which inputs have no finite value at a time near the end of a run, or else why, or what may have none."""
    mechanism, end = run.ready.mechanism, run.integration
    unknown = "a force or an expression has no finite value there, or the motion grows without bound"
    if names := _inputs_without_value(run, time):
        has = "has" if len(names) == 1 else "have"
        told = f"the input{'s' * (len(names) > 1)} {', '.join(names)} {has} no finite value there"
        declared = {name: getattr(run.ready.system.inputs[name], "outside", "") for name in names}
        left = [name for name, outside in declared.items() if outside == "error"]
        where = "; an argument is outside of its table, or grid: give more of it, or `outside: hold` or `extrapolate`"
        return Reason(told + where * bool(left), ends=True)
    if cause := _cause(run, time) or _without_value(run, time):
        return Reason(cause, ends=True)
    fastest = max(zip(mechanism.speeds, end.u_final.tolist(), strict=True), key=lambda each: abs(each[1]), default=None)
    if fastest is None:
        return Reason(unknown)
    return Reason(f"{unknown}: the largest speed, {fastest[0].name}, is {fastest[1]:.3g} {fastest[0].unit}")


def _inputs_without_value(run: Trajectory, time: float) -> list[str]:
    """Return the inputs without a finite value at the state in which a run ended, or at the next one."""
    problem, x = run.problem, _final(run)
    if not run.ready.mechanism.inputs:
        return []
    rates = np.nan_to_num(problem.rates(time, x), posinf=0.0, neginf=0.0)
    for part in _NEXT:
        ahead = part * problem.lasts
        q, u = np.split(x + ahead * rates, [len(problem.q0)])
        (values,) = problem.compiled["inputs"](time + ahead, q, u, problem.parameters)
        names = [name for name, each in zip(run.ready.mechanism.inputs, values, strict=True) if not np.isfinite(each)]
        if names:
            return names
    return []


def _without_value(run: Trajectory, time: float) -> str | None:
    """Return which force or rate has no finite value at the end of a run, or just behind it; None for none."""
    system, (entered, values) = run.ready.system, _ended_in(run)
    x, nq = _final(run), len(run.problem.q0)
    slope = np.nan_to_num(_rates(run, run.integration.t_final, x))
    given = {symbol(e.name): v for e, v in zip(entered.parameters, values, strict=True) if e.source is Source.DECLARED}
    named = [symbol(c.name) for c in entered.coordinates] + [symbol(s.name) for s in entered.speeds]
    written = expressions_in(system, ("forces", "states"))
    for part in _BEHIND:
        ahead = part * (time - run.problem.t0)
        known = {**given, symbol("t"): time + ahead, **dict(zip(named, (x + ahead * slope).tolist(), strict=True))}
        slots = {slot("parameters", k): v for k, v in enumerate(values)} | {TIME: time + ahead}
        slots |= {slot("q" if k < nq else "u", k if k < nq else k - nq): known[n] for k, n in enumerate(named)}
        inputs = {symbol(name): value_or_none(node, slots) for name, node in entered.inputs.items()}
        known |= {name: v for name, v in inputs.items() if v is not None}
        for path, node, _ in written:
            if node.shadow is None and all(leaf in known for leaf in leaves([node], "symbol", "quantity")):
                found = value_or_none(node, known)
                if found is None or not math.isfinite(found):
                    return f"{'.'.join(path)}: {undefined_text(node, known)}"
    return None


def mass_used_up(run: Trajectory) -> str | None:
    """Return that a body whose mass varies has none left at the end of a run, and when; None where each has."""
    mechanism, end = run.ready.mechanism, run.integration
    varying = [body for body in mechanism.bodies if varies(body)]
    if not varying:
        return None
    failed = end.failure is not None and end.failure.status is not Status.INTERRUPTED
    first, last = (
        state_of(mechanism, float, t, q.tolist(), u.tolist(), run.parameters.tolist())
        for t, q, u in ((run.problem.t0, run.problem.q0, run.problem.u0), (end.t_final, end.q_final, end.u_final))
    )
    for body in varying:
        begun, left = (float(state.values([body.mass.mass])[0]) for state in (first, last))
        if (failed and left <= _USED_UP * begun) or (run.stop or {}).get("element") == used_up(body.name):
            return (
                f"the mass of {body.name} is used up at t = {end.t_final:.6g} s, and no mass is negative: end the run "
                f"before, or let the mass stay what is left: mass: {{value: max(m0 - k*t, m1), ..}}"
            )
    return None


def wheel_left(run: Trajectory) -> str | None:
    """Return that a run ends where a rope comes off a wheel, and when; None where something else ends it."""
    name = (run.stop or {}).get("element", "")
    if " " not in name:  # declared: a run that is recalled needs no mechanism to tell it
        return None
    mechanism = run.ready.mechanism
    stop, names = mechanism.stops.get(name, ZERO), {row.name: row.rope for row in ropes(mechanism)}
    for row, pulley in (leaf.data[1] for leaf in leaves([stop], "quantity") if leaf.data[0] == "wrap"):
        return (
            f"{names[row]} comes off {pulley} at t = {run.integration.t_final:.6g} s: it lies around none of the wheel "
            "any more, and no motion without it is computed; end the run before, or take the pulley out of its path"
        )
    return None


def _advice_on_steps(run: Trajectory, time: float) -> str:
    """Return what to do about too many steps; a force that jumps with a speed is dry friction, which has a rest."""
    mechanism = run.ready.mechanism
    first, last = _first_and_last(run, time)
    found = _met(_point_lines(mechanism), first, last) or _gimbal_lock(last) or _about_nothing(first, last)
    if told := found or _turns_fast(run, time, last):
        return told
    named = dict.fromkeys(leaf.data[1] for leaf in leaves(mechanism.kinks, "slot") if leaf.data[0] == "u")
    place = next((k for k in named if _jumps_with(run, time, k)), None)
    if place is None:
        jump = "a jump in a force (sign, where) keeps steps short; else ask for" if mechanism.kinks else "ask for"
        return stiffness_of(run, time) or f"{jump} less accuracy or a shorter time"
    speed = mechanism.speeds[place]
    units = [each.unit for each in mechanism.speeds if each.joint == speed.joint]
    contact = "a contact with static and kinetic, which stick and slip"
    rub = f"forces: {{rub: {{type: friction, joint: {speed.joint}, static: mu, kinetic: mu}}}} or {contact}"
    return (
        f"a force jumps where {speed.name} changes its sign, and has no value at rest; declare dry friction as such, "
        f"{rub if len(set(units)) == len(units) else contact}"  # joints of several like ways have no friction
    )


def _jumps_with(run: Trajectory, time: float, place: int) -> bool:
    """Return whether accelerations jump where a speed is at the end of a run: what changes does so however near."""
    q, u = run.integration.q_final, run.integration.u_final
    changes = []
    for beside in (part * np.abs(u).max(initial=1.0) for part in _WHY_FAILED_BESIDE):
        sides = [np.concatenate([q, u + side * beside * np.eye(len(u))[place]]) for side in (1.0, -1.0)]
        above, below = (_rates(run, time, x)[len(q) :] for x in sides)
        changes.append(float(np.abs(above - below).max()))
    return changes[1] > _KEPT * changes[0] > 0.0


def _is_too_long(problem: Problem, failed: float) -> bool:
    """Tell whether a first step as the motion at the start needs it is hardly longer than the least of the run.

    Not if what has failed at a time has no value then, wherever the motion is.
    """
    span = _FEW * least_step(problem.t0, problem.t_end)
    flow = Flow(
        problem.method, problem.rates, problem.t0, problem.t0 + span, problem.x0, rtol=problem.rtol, atol=problem.atol
    )
    try:
        flow.slope(failed, flow.x0)
        return first_step(flow, flow.t0, flow.x0, flow.slope(flow.t0, flow.x0)) < span
    except StepError:
        return False


def _singular(run: Trajectory, time: float) -> Reason:
    """Return that rows become dependent at a time near the end of a run, and which; or that friction jams there."""
    mechanism, parameters = _ended_in(run)
    rows = ConstraintRows(mechanism, parameters, range(len(mechanism.rows)), time)
    motion = rows.motion(run.integration.q_final, run.integration.u_final)
    first = rows.motion(run.ready.q0, run.ready.u0)
    if vanishing := _in_line(first, motion) or _growing_speed(run, time, motion):
        return Reason(f"no step was found that leads on from t = {time:.6g} s: {vanishing}", ends=True)
    generic = mechanism.parameters.independent_rows(parameters)
    found = nearly_dependent(composite_body(mechanism, motion.state), generic)
    if run.modes is not None and run.modes.legs:
        from multibody_sym.motion.switching.jams import jams  # brings what runs without modes do without

        if jams(run.modes.legs[-1], time, _final(run)):
            sliding = [row.name for row in mechanism.rows if row.sliding]
            return Reason(
                f"friction jams at t = {time:.6g} s: with their friction the forces at {', '.join(sliding)} hardly "
                "move what they press (Painleve's paradox), and no change of their sign was found behind which the "
                "motion goes on; lower the friction, or end the run before"
            )
    if found.independence > _APART:
        from multibody_sym.motion.switching.jams import feeds_itself  # likewise
        from multibody_sym.motion.switching.mode_run import ModeRun

        modes = run.modes if isinstance(run.modes, ModeRun) and run.modes.legs else None
        if modes is not None and (part := feeds_itself(modes.legs[-1], modes.switches.at(time, _final(run)))):
            return Reason(
                f"friction jams at t = {time:.6g} s: {part} makes nearly all of what presses it, as bodies without "
                "mass take no more of it; give them a mass, lower the friction, or end the run before"
            )
        return Reason(
            f"no step was found that leads on from t = {time:.6g} s, as near a singular position, though no "
            "constraints depend on each other there; take other steps or tolerances, or another method"
        )
    come = "come" if len(found.names) > 1 else "comes"
    return Reason(
        f"singular position at t = {time:.6g} s: {', '.join(found.names)} {come} to depend on the other constraints, "
        "or to hold nothing, forces grow without bound there, and no step leads across; take other steps or "
        "tolerances, or another method",
        ends=True,
    )


def _ended_in(run: Trajectory) -> tuple[Mechanism, list[float]]:
    """Return the mechanism in the mode in which a run ended, whose rows a failure counts, and its parameters."""
    if run.modes is None or not run.modes.legs:
        return run.ready.mechanism, run.parameters.tolist()
    last = run.modes.legs[-1]
    return last.program.entered, last.parameters


def _in_rows_of_its_mode(run: Trajectory, failure: RunFailure) -> RunFailure:
    """Return a failure whose row is counted among those of the mode in which the run ended, not of all modes."""
    if run.modes is None or not run.modes.legs or failure.status not in _OF_MODE or failure.component is None:
        return failure
    program = run.modes.legs[-1].program
    name, own = program.mechanism.rows[failure.component].name, [row.name for row in program.entered.rows]
    return replace(failure, component=own.index(name) if name in own else None)


def until_departure(mechanism: Mechanism, problem: Problem, done: Integration) -> Integration:
    """Return a run, as failed at the first sample at which it had left its constraints if it did."""
    rows = ConstraintRows(mechanism, problem.parameters.tolist(), range(len(mechanism.rows))).holonomic()
    places = np.unique(np.linspace(0, len(done.t) - 1, _SIZED).astype(int))
    seen = [missed.sizes for missed in (_row_residual(rows, done, int(k)) for k in places) if missed is not None]
    largest = np.max(seen, axis=0, initial=0.0)
    allowed = _LEFT * np.where(largest > 0.0, largest, np.inf)
    for k in range(len(done.t)):
        missed = _row_residual(rows, done, k)
        left = np.zeros(0) if missed is None else np.flatnonzero(np.abs(missed.residuals) > allowed)
        if len(left):
            t, q, u = done.t[: k + 1], done.q[: k + 1], done.u[: k + 1]
            failure = RunFailure(Status.LEFT, float(t[k]), rows.active[int(left[0])])
            return replace(done, t=t, q=q, u=u, t_final=float(t[k]), q_final=q[k], u_final=u[k], failure=failure)
    return done


def _row_residual(rows: ConstraintRows, done: Integration, k: int) -> Residual | None:
    return replace(rows, t=float(done.t[k])).missed(done.q[k])
