"""`modes`: small motions about an equilibrium or a steady motion: M, C, K, frequencies and normal modes as formulas."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from multibody_sym.analysis.linearization import At
from multibody_sym.answers.small_motions.record import Modes
from multibody_sym.answers.small_motions.small_motion import SmallMotion
from multibody_sym.dynamics.start.examined import numbers_of
from multibody_sym.model.declaration.system import System
from multibody_sym.model.resolution.changes import Changes


def modes(
    system: System,
    *,
    at: At = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Modes:
    """Return the small motions of a system about its start, in formulas as far as there are any.

        M x'' + C x' + K x = 0        det(K - omega^2 M) = 0

    The start if it is an equilibrium or a steady motion, else the one found beside it (`Modes.found`); `at` another
    state, as for `linearize`. In a steady motion the momenta of cyclic coordinates are held (Routh). Frequencies are
    ordered by size at the declared parameters. With dampers and more freedoms than one, frequencies are those without
    them. `parameters` .. `project`: what the call changes of the system (`Changes`); `formalism` for the numbers.
    Raises InputError, and NoSolutionError where there is no such state or nothing is free to move.
    """
    asked = Changes(parameters, initial, inputs, coordinates, project).of(system)
    with numbers_of(asked):
        return SmallMotion.of(asked, formalism, at).told()
