"""The initial value problem of a run: settings in numbers, and how its constraints are kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.programs.switching import switchings
from multibody_sym.dynamics.start.mass_jumps import verify_mass_laws
from multibody_sym.dynamics.start.smooth_motions import verify_motions
from multibody_sym.dynamics.start.start import verify_regular_start
from multibody_sym.errors import ModelError, at
from multibody_sym.integrators.flow import Status
from multibody_sym.integrators.pairing import Pairing
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.runtime.integration import integrate
from multibody_sym.runtime.problem import Loop, Problem
from multibody_sym.scalars.kinks import known_zeros
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import postorder
from multibody_sym.simulation.runs.runnable import Runnable
from multibody_sym.simulation.settings import RunSettings, run_settings

_BY_FIXED_STEP: Final = 0.05
_BY_MEAN_STEP: Final = 0.01
_MOST_NUMBERS: Final = 250_000_000  # two gigabytes of samples
_MOST_STEPS: Final = 200_000_000


def settings_of(ready: Runnable) -> RunSettings:
    """Return the settings of a system in numbers. Raises ModelError."""
    return run_settings(ready.system.simulation, ready.parameter_values)


def problem_of(ready: Runnable, settings: RunSettings) -> Problem:
    """Return the problem of a run; with rows it projects each step, or stabilises them (Baumgarte 1972) if asked.

    Raises ModelError for more samples than memory holds, more steps than a life has time for, where nothing moves, and
    where a prescribed motion jumps, or its speed does;
    NoSolutionError where the start is a singular position.
    """
    _verify_size(ready, settings)
    if ready.start.assembled:  # what is declared is examined already
        values = _start_values(ready)
        verify_motions(ready.system, values, settings.t_end)
        verify_mass_laws(ready.system, values, settings.t_end)
    verify_regular_start(ready.mechanism, ready.start)
    mechanism, constrained = ready.mechanism, bool(ready.mechanism.rows)
    margins = (0.0,) * (len(switchings(mechanism)) if ready.laws is None else ready.laws.functions)
    parameters, modes = ready.parameters, np.empty(0)
    if ready.laws is not None:
        parameters, modes = ready.laws.numbers(mechanism, parameters)
    problem = Problem(
        compiled=ready.compiled,
        method=settings.method,
        t0=0.0,
        t_end=settings.t_end,
        q0=ready.q0,
        u0=ready.u0,
        parameters=parameters,
        modes=modes,
        step=settings.step,
        rtol=settings.rtol,
        atol=settings.atol,
        samples=settings.samples,
        project=constrained and settings.project,
        max_steps=_MOST_STEPS,
        independent=float(ready.mechanism.parameters.independent_rows(ready.start.parameters)),
        terminal=(True,) * len(mechanism.stops)
        + (False,) * (len(mechanism.kinks) + len(mechanism.fades))
        + (True,) * len(margins),
        margins=margins,
        moments=_knots(mechanism, settings.t_end),
        pairs=_pairing(ready.mechanism),
    )
    if not constrained or settings.baumgarte is None or ready.state.declared.one_way:
        return problem
    alpha, beta = settings.baumgarte.chosen(lambda: own_coefficient(problem))
    return replace(problem, parameters=ready.stabilised_by(alpha, beta))


def _knots(mechanism: Mechanism, t_end: float) -> tuple[float, ...]:
    """Return the knots of long tables of time, rising, over which no step leads: one function tells of all of them."""
    tables = [g for g in mechanism.kinks if g.op == "table" and _letters(g) == [TIME]]
    found = {t for g in tables for t in known_zeros(g, TIME, {}) or ()}
    return tuple(sorted(t for t in found if 0.0 < t < t_end))


def _letters(node: Node) -> list[Node]:
    return [n for n in postorder([node]) if not n.args and n.shadow is None]


def _start_values(ready: Runnable) -> dict[Node, float]:
    """Return the values of parameters, and of coordinates at the start, by their symbols."""
    names = (symbol(coordinate.name) for coordinate in ready.mechanism.coordinates)
    return {**dict(zip(names, ready.q0.tolist(), strict=True)), **ready.parameter_values}


def _pairing(mechanism: Mechanism) -> Pairing:
    plain: list[tuple[int, int]] = []
    balls: list[tuple[int, int]] = []
    for body in mechanism.bodies:
        plain += body.rate_pairs
        for free in (free for free in body.free_steps if not free.step.speeds_are_rates):
            if not free.step.unit_quaternion:
                raise TypeError(f"nothing says how methods take the coordinates of {type(free.step).__name__} on")
            balls.append((free.q[0], free.u[0]))
    return Pairing(len(mechanism.coordinates), tuple(plain), tuple(balls))


def _verify_size(ready: Runnable, settings: RunSettings) -> None:
    width = len(ready.q0) + len(ready.u0)
    if width == 0 and not ready.mechanism.drives:
        raise ModelError("nothing can move: no joint has freedom", number="M117").under("joints")
    with at("simulation"):
        most = _MOST_NUMBERS // max(width, 1)
        if settings.samples > most:
            raise ModelError(f"{settings.samples} samples are too many; at most {most}", number="M109").under("samples")
        if settings.step is not None and settings.t_end / settings.step > _MOST_STEPS:
            raise ModelError(f"{settings.t_end / settings.step:.3g} steps are too many", number="M117").under("step")


def own_coefficient(problem: Problem, loop: Loop | None = None) -> float:
    """Return alpha = beta: 0.05/h for a fixed step; else 0.01/h with the mean accepted step h of a run without it.

    It is a constant of the run, for tied to the current step it would shorten the step that it is chosen from.
    """
    if problem.step is not None:
        return _BY_FIXED_STEP / problem.step
    pilot = integrate(replace(problem, samples=2), loop=loop)
    if pilot.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    mean_step = pilot.statistics.mean_step
    return _BY_MEAN_STEP / mean_step if mean_step > 0.0 else 0.0
