"""`modes`: small motions about an equilibrium or a steady motion: M, C, K, frequencies and normal modes as formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from multibody_sym.analysis.linearize import At
from multibody_sym.analysis.modes.amplitude import NoPeriodError, period_of
from multibody_sym.analysis.modes.record import Modes
from multibody_sym.analysis.modes.small_motion import SmallMotion
from multibody_sym.dynamics.start.number_checks import numbers_of
from multibody_sym.errors import at as under
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.model.argument_checks import text
from multibody_sym.model.system import System
from multibody_sym.text.values import Value


def modes(
    system: System,
    *,
    at: At = None,
    period: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Modes:
    """Return the small motions of a system about its start, in formulas as far as there are any.

        M x'' + C x' + K x = 0        det(K - omega^2 M) = 0

    The start if it is an equilibrium or a steady motion, else the one found beside it (`Modes.found`), a stable one
    if there is any; `at` another state, as for `linearize`. In a steady motion the momenta of cyclic coordinates are
    held (Routh). Frequencies are ordered by size at the declared parameters. With dampers and more freedoms than one,
    frequencies are those without them. `period`: a coordinate whose period in the motion from the start is returned too
    (`Modes.period`), whatever its amplitude: a number, with its accuracy in a note. `parameters` .. `project`: what the
    call changes of the system (`Overrides`); `formalism` for the numbers.
    Raises InputError, and NoSolutionError where there is no such state or nothing is free to move.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    with numbers_of(changed):
        found = SmallMotion.of(changed, formalism, at).as_modes()
        if period is None:
            return found
        with under("period"):
            coordinate = text("period", period)
            try:
                known = period_of(changed, coordinate)
                note, value = f"the period of {coordinate} is known {known.how}", known.value("s")
            except NoPeriodError as reason:
                note, value = f"no period is told: {reason}", Value(None, None, "s")
            return replace(found, period=value, notes=(*found.notes, note))
