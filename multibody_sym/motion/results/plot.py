"""What of a run a plot shows: a panel for each unit, names that were asked for, changes as marks."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.errors import ArgumentError, InputError, short_repr
from multibody_sym.motion.results.samples import Samples
from multibody_sym.pictures.plots import Panel, Plot, PlotMark, PlottedCurve
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.values import Units, chosen_units

_TIME: Final = "t"
_LENGTH: Final = "m"
_OUTPUT: Final = "output "
"""What stands before the name of an output that is called like a coordinate, as in tables."""
_TURNS: Final = 4
_CHANGE: Final = "energy_change"
_ENERGIES: Final = {
    "kinetic_energy": lambda run: run.kinetic_energy,
    "potential_energy": lambda run: run.potential_energy,
    "energy": lambda run: run.energy,
    _CHANGE: lambda run: run.energy - run.energy[:1],
}
"""What every run has beside its names, in J."""


def plot(
    runs: Samples | Sequence[Samples] | Mapping[str, Samples],
    path: str | os.PathLike[str] | None = None,
    units: str | Sequence[str] | Units | None = None,
    *,
    show: str | Sequence[str] | None = None,
    x: str = _TIME,
) -> Any:
    """Return a matplotlib figure of one run, or of several by name in one picture; written to `path` if one is given.

    It has a panel for each unit, outputs first, then coordinates and speeds; more than eight curves have small axes
    each. Angles are in degrees, or in turns if they pass four of them, unless `units` are given. `show` names what is
    shown, as `"theta,psi"` or a list: coordinates, speeds, inputs, outputs, `kinetic_energy`, `potential_energy`,
    `energy` and `energy_change` (since the start); without it all outputs, coordinates and speeds. It is drawn over
    `x`, time or another of these names: `x="theta"` gives phase plots, and two lengths a path to scale. What begins to
    stick, slide, open or close is marked.
    Raises InputError for what is no unit and no name of a run, OutputError where matplotlib is missing or the file
    cannot be written.
    """
    from multibody_sym.pictures.page.files import write_figure
    from multibody_sym.pictures.plots import figure_of

    named, chosen = _by_name(runs), chosen_units(units)
    if not chosen.chosen:  # angles as people read them: degrees, turns where there are many; rates stay in rad/s
        angles = (run[name] for run in named.values() for name, unit in run.units.items() if unit == "rad")
        largest = max((float(np.max(np.abs(values), initial=0.0)) for values in angles), default=0.0)
        chosen = chosen_units(f"{'turn' if largest > _TURNS * 2.0 * math.pi else 'deg'},rad/s,rad/s^2")
    figure = figure_of(plot_of(named, chosen, show, x))
    if path is not None:
        write_figure(figure, path)
    return figure


class _Column(NamedTuple):
    """Numbers of a run in the unit that is told: empty, or `quaternion`, where there is none."""

    values: Floats
    unit: str


def plot_of(
    runs: Mapping[str, Samples], units: Units, show: str | Sequence[str] | None = None, x: str = _TIME
) -> Plot:
    """Return what a plot of runs shows, by panels."""
    wanted = _words(show)
    panels: dict[tuple[bool, str], list[PlottedCurve]] = {}
    across = ""
    for k, run in enumerate(runs.values()):
        base, across = _across(run, x, units)
        for name in wanted or [each for each in (*_outputs(run), *run.coordinates, *run.speeds) if each != x]:
            column = _column(run, name, units)
            place = name.removeprefix("u_")
            rate_of = place if place != name in run.speeds and place in run.coordinates else ""
            state = not wanted and name in run.units
            panels.setdefault((state, column.unit), []).append(
                PlottedCurve(name, base.values, column.values, k, rate_of)
            )
    found = []
    for (_, unit), curves in panels.items():
        size = 0.0  # the kinetic energy that energies are judged against: less than a millionth of it is drift
        if unit == units.of("J") and not any(curve.name == _CHANGE for curve in curves):
            size = float(max(np.max(run.kinetic_energy, initial=0.0) for run in runs.values())) / units.size("J")
        found.append(Panel(unit, tuple(curves), size))
    over_time = x == _TIME
    marks = tuple(_marks(next(iter(runs.values())), units, found, over_time)) if len(runs) == 1 else ()
    title = ", ".join(dict.fromkeys(run.ready.told.name for run in runs.values()))
    equal = not over_time and all(panel.unit and panel.unit == base.unit for panel in found)
    equal = equal and base.unit == units.of(_LENGTH)
    return Plot(title, across, tuple(found) or (Panel("", ()),), marks, tuple(runs), over_time, equal)


def _by_name(runs: Any) -> Mapping[str, Samples]:
    if isinstance(runs, Samples):
        return {"": runs}
    if isinstance(runs, Mapping):
        found = {str(name): run for name, run in runs.items()}
    elif isinstance(runs, (list, tuple)):
        found = {f"run {k}": run for k, run in enumerate(runs, 1)}
    else:
        raise ArgumentError(f"runs: expected a Trajectory, a list of them or a map by name, got {short_repr(runs)}")
    odd = [run for run in found.values() if not isinstance(run, Samples)]
    if odd or not found:
        raise ArgumentError(f"runs: expected Trajectories, got {short_repr(odd[0] if odd else runs)}")
    return found


def _words(show: str | Sequence[str] | None) -> list[str]:
    if show is None:
        return []
    words = show.split(",") if isinstance(show, str) else list(show) if isinstance(show, (list, tuple)) else []
    if not words or not all(isinstance(word, str) and word.strip() for word in words):
        raise ArgumentError(f"show: expected names such as 'theta,psi', got {short_repr(show)}")
    return [word.strip() for word in words]


def outputs_and_places(run: Samples) -> list[str]:
    """Return the outputs and the coordinates that are no quaternions, or where there are none the speeds."""
    quaternions = set(run.ready.told.quaternions)
    return [*_outputs(run), *(name for name in run.coordinates if name not in quaternions)] or list(run.speeds)


def _outputs(run: Samples) -> list[str]:
    taken = {*run.coordinates, *run.speeds, _TIME}
    return [f"{_OUTPUT}{name}" if name in taken else name for name in run.outputs]


def _across(run: Samples, x: str, units: Units) -> tuple[_Column, str]:
    if not isinstance(x, str):
        raise ArgumentError(f"x: expected a name such as 'theta', got {short_repr(x)}")
    if x == _TIME:
        return _Column(run.t / units.size("s"), units.of("s")), f"t [{units.of('s')}]"
    column = _column(run, x, units)
    return column, f"{x} [{column.unit}]" if column.unit else x


def _column(run: Samples, name: str, units: Units) -> _Column:
    if name in run.units:
        unit = run.units[name]
        told = units.of(unit) or ("quaternion" if name in run.ready.told.quaternions else "")
        return _Column(run[name] / units.size(unit), told)
    output = name.removeprefix(_OUTPUT)
    if output in run.outputs:
        unit = run.output_units[output]
        return _Column(run.outputs[output] / units.size(unit), units.of(unit))
    if name in _ENERGIES:
        return _Column(_ENERGIES[name](run) / units.size("J"), units.of("J"))
    known = [*run.units, *run.outputs, *_ENERGIES]
    raise InputError(f"nothing in this run is called {name!r}", number="M106", word=name, known=known)


def _marks(run: Samples, units: Units, panels: Sequence[Panel], over_time: bool) -> Iterator[PlotMark]:
    for event in (*getattr(run, "begun", ()), *run.changes):
        text, t = f"{event['element']} {event['kind']}", float(event["t"])
        if over_time:
            yield PlotMark(t / units.size("s"), text)
            continue
        at = int(np.searchsorted(run.t, t).clip(0, len(run.t) - 1))
        places = [(k, curve.x[at], curve.y[at]) for k, panel in enumerate(panels) for curve in panel.curves]
        yield PlotMark(t, text, tuple((k, float(x), float(y)) for k, x, y in places))
