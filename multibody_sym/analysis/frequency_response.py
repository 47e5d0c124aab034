"""The response of a linearised system to inputs that oscillate: gain and phase over frequency, as in Bode's plots."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.linearize import At, Linearization, linearize, place_of
from multibody_sym.errors import ArgumentError, InputError, short_repr
from multibody_sym.model.argument_checks import door
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats

if TYPE_CHECKING:
    from multibody_sym.pictures.notebook_figure import ShownFigure

_DECADE: Final = 10.0
_POINTS: Final = 400
"""An even number: the middle, the frequency of a single eigenvalue without damping, is between two."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """The `response` (n, p, k) of p `outputs` to k `inputs` at n angular frequencies `omega` (rad/s), complex.

    An input cos(omega t) leads to the output |G| cos(omega t + phase) when all else has died down.
    """

    omega: Floats
    response: npt.NDArray[np.complex128]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<FrequencyResponse of {', '.join(self.outputs)} by {', '.join(self.inputs)}: {len(self.omega)} points>"

    @property
    def gain(self) -> Floats:
        """|G| (n, p, k), in the unit of the output by that of the input."""
        return np.abs(self.response)

    @property
    def decibels(self) -> Floats:
        """20 log10 |G| (n, p, k)."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(self.gain))

    @property
    def phase(self) -> Floats:
        """The angle of G (n, p, k) in rad, without jumps along the frequencies; negative where the output lags."""
        return np.asarray(np.unwrap(np.angle(self.response), axis=0))

    @door
    def plot(self, path: str | os.PathLike[str] | None = None) -> ShownFigure:
        """Return a matplotlib figure of gain and phase, written to `path` if one is given.

        Raises InputError for what is no path, OutputError where matplotlib is missing or the file cannot be written.
        """
        from multibody_sym.pictures.page.raster import write_figure
        from multibody_sym.pictures.plots import Panel, Plot, PlottedCurve, figure_of

        pairs = [(i, j) for i in range(len(self.outputs)) for j in range(len(self.inputs))]

        def panel(unit: str, values: Floats) -> Panel:
            curves = (
                PlottedCurve(f"{self.outputs[i]} by {self.inputs[j]}", self.omega, values[:, i, j]) for i, j in pairs
            )
            return Panel(unit, tuple(curves))

        panels = panel("dB", self.decibels), panel("deg", np.degrees(self.phase))
        figure = figure_of(Plot("frequency response", "angular frequency [rad/s]", panels))
        for axis in figure.axes:
            axis.set_xscale("log")
        if path is not None:
            write_figure(figure, path)
        return figure


def bode(
    system: System | Linearization,
    omega: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] | str = (),
    outputs: Sequence[str] | str = (),
    at: At = None,
) -> FrequencyResponse:
    """Return the response of a system's outputs to its inputs over angular frequencies `omega` (rad/s).

    `system`: a Linearization, or a System, which is linearised `at` a state as `linearize` does. `inputs` and `outputs`
    by name; all, if none are named; without declared outputs those are the states. Without `omega` frequencies reach
    from a tenth of the slowest eigenvalue to ten times the fastest.
    Raises InputError for unknown names and wrong frequencies, NoSolutionError where A is not constant, and what
    `linearize` raises.
    """
    if isinstance(system, System):
        system = linearize(system, at=at)
    elif at is not None and isinstance(system, Linearization):
        raise InputError("a Linearization has its state: give bode the System to linearise it at another one")
    elif not isinstance(system, Linearization):
        raise ArgumentError(f"bode takes a System or a Linearization, not {short_repr(system)}")
    if not system.inputs or not system.states:
        raise InputError("a response needs an input: declare one (inputs: ..) that no constraint or motion follows")
    every = system.outputs or system.states
    rows = [place_of("output", name, every) for name in listed_names("outputs", outputs) or every]
    columns = [place_of("input", name, system.inputs) for name in listed_names("inputs", inputs) or system.inputs]
    w = _frequencies(system) if omega is None else np.atleast_1d(floats("omega", omega))
    if w.ndim != 1 or not (np.isfinite(w) & (w > 0.0)).all():
        raise InputError("omega is a positive angular frequency in rad/s, or a vector of them")
    points = 1j * w if system.dt is None else np.exp(1j * w * system.dt)
    response = system.response(points)[:, rows][:, :, columns]
    return FrequencyResponse(w, response, tuple(every[k] for k in rows), tuple(system.inputs[k] for k in columns))


def _frequencies(system: Linearization) -> Floats:
    """Return frequencies a decade around the eigenvalues, of samples up to half their frequency."""
    values = np.linalg.eigvals(system.A).astype(complex)
    if system.dt is not None:
        values = np.log(values[values != 0.0]) / system.dt
    sizes = np.abs(values)[np.abs(values) > 0.0]
    low, high = (float(sizes.min()), float(sizes.max())) if len(sizes) else (1.0, 1.0)
    high = high * _DECADE if system.dt is None else np.pi / system.dt
    return np.geomspace(min(low / _DECADE, high / _DECADE), high, _POINTS)
