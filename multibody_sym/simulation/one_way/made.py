"""The run of a system of which some holds one way only, as it is asked for, and its modes compiled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from multibody_sym.model.declaration.settings import Settings
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.one_way.every import LawMechanism
from multibody_sym.simulation.one_way.facts import Laws
from multibody_sym.simulation.one_way.mode_run import ModeRun
from multibody_sym.simulation.one_way.modes import Modes
from multibody_sym.simulation.one_way.moments import moments
from multibody_sym.simulation.one_way.prepared import PreparedRuns
from multibody_sym.simulation.one_way.tips import first_normal
from multibody_sym.simulation.problem import own_coefficient
from multibody_sym.simulation.recall import compiled, recalled_laws
from multibody_sym.simulation.runs.runnable import Runnable
from multibody_sym.simulation.settings import RunSettings, form_of


def one_way_runs(
    ready: Runnable, template: Problem, settings: RunSettings, *, native: bool = False, backend: Backend | None = None
) -> Callable[[], ModeRun]:
    """Return what begins a run of a system of which some holds one way only."""
    known = ready.mechanism.parameters.places
    laws_of = ready.laws or LawMechanism.of(ready.state.declared, ready.system.simulation)
    declared, bars, every = laws_of.declared, laws_of.bars, laws_of.every
    begun = None if ready.laws else (ready.mechanism, ready.compiled)
    make = partial(_made, begun, ready.system.simulation, ready.formalism, native, backend)
    values = [ready.parameters[known[x.name]] if x.name in known else first_normal(x) for x in declared.parameters]
    form = (ready.formalism, form_of(ready.system.simulation, constrained=True, varies=True)) if every else None
    recalled = recalled_laws(declared, form, native=native, backend=backend)
    laws = Laws(declared, recalled.compiled, recalled.metadata, np.array(values, dtype=float))
    looks = tuple(moments(ready.system, ready.parameter_values, settings.t_end).tolist())
    assert ready.state.posed is not None  # what holds one way only poses its laws at the start
    scale = ready.state.posed.rows.scale
    template = replace(template, project=settings.project, moments=looks)
    served = None if every is None else (every, laws.compiled)

    def runs(of: Problem, stabilised: tuple[float, float] | None) -> PreparedRuns:
        modes = Modes(declared, make, of, stabilised or (0.0, 0.0), served)
        return PreparedRuns(laws, modes, of, scale, stabilised, bars)

    def own() -> float:
        pilot = ModeRun(prepared=runs(replace(template, samples=2), None))
        return own_coefficient(pilot.legs[0].of, pilot.loop)

    stabilised = None if settings.baumgarte is None else settings.baumgarte.chosen(own)
    return partial(ModeRun, prepared=runs(template, stabilised))


def _made(
    begun: tuple[Mechanism, Compiled] | None,
    settings: Settings,
    formalism: str,
    native: bool,
    backend: Backend | None,
    entered: Mechanism,
) -> Compiled:
    """Return a mechanism in a mode, compiled; that with which a run has `begun` is so. No closure, to be pickled."""
    form = form_of(settings, constrained=bool(entered.rows), varies=True)
    if begun is not None and not entered.rows and entered == begun[0]:
        return begun[1]
    if form == "index_2" and len(entered.held) == len(entered.speeds):
        form = "implicit"  # nothing moves: no rows have to be kept
    return compiled(entered, formalism, form, native=native, backend=backend)
