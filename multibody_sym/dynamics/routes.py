"""All formalisms by name: independent routes from a mechanism to the same equations of motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from multibody_sym.dynamics.formalisms.block_ldl import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.dalembert import dalembert_lagrange
from multibody_sym.dynamics.formalisms.equations import Formalism, TreeDynamics
from multibody_sym.dynamics.formalisms.massless import massless_speeds
from multibody_sym.dynamics.formalisms.newton_euler import newton_euler
from multibody_sym.dynamics.formalisms.sweep import sweep
from multibody_sym.errors import InputError, at, shown, suggestion
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism


def _lagrange(mechanism: Mechanism, state: State) -> TreeDynamics:
    from multibody_sym.dynamics.derivation.lagrange import lagrange

    return lagrange(mechanism, state)


def _multipliers(mechanism: Mechanism, state: State) -> TreeDynamics:
    from multibody_sym.dynamics.derivation.multipliers import multipliers

    return multipliers(mechanism, state)


FORMALISMS: Final[Mapping[str, Formalism]] = {
    "newton_euler": newton_euler,
    "dalembert_lagrange": dalembert_lagrange,
    "composite_body": composite_body,
    "block_ldl": block_ldl,
    "sweep": sweep,
    "lagrange": _lagrange,
    "multipliers": _multipliers,
}
"""Each by name. Those that derive with sympy import it when they are called."""


def verify_formalism(name: object) -> None:
    """Raise InputError unless `name` is a formalism's, or None for the cheapest."""
    if name is not None and (not isinstance(name, str) or name not in FORMALISMS):
        with at("formalism"):
            raise InputError(f"there is no formalism {shown(name)}{suggestion(str(name), FORMALISMS)}")


_DEEPEST_FORMED: Final = {False: 4.5, True: 6.0}
"""Mean number of freedoms in a row up to which forming M takes fewer operations, without and with rows to hold."""


def cheapest(mechanism: Mechanism) -> str:
    """Return the name of the formalism whose programs of a mechanism take the fewest operations, or nearly so.

    A column of M costs as much as there are freedoms between its joint and the ground, the recursion the same for each
    body; `benchmarks/formalisms.py` counts both.
    """
    if massless_speeds(mechanism):
        return "composite_body"
    above: list[int] = []
    for body in mechanism.bodies:
        above.append((above[body.parent] if body.parent >= 0 else 0) + len(body.u))
    moved = [body for body in mechanism.bodies if body.u]
    depths = [above[i] - k for i, body in enumerate(mechanism.bodies) for k in range(len(body.u))]
    formed = sum(depths) <= _DEEPEST_FORMED[bool(mechanism.rows)] * len(moved)
    return "composite_body" if formed else "block_ldl"
