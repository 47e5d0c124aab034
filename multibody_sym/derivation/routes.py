"""All formalisms by name: independent routes from a mechanism to the same equations of motion.

Whoever runs programs imports this file: sympy is imported when a route needs it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl, sweep
from multibody_sym.dynamics.formalisms.composite_body import composite_body, dalembert_lagrange, newton_euler
from multibody_sym.dynamics.formalisms.equations import Formalism, TreeDynamics, massless_speeds
from multibody_sym.errors import InputError, at, short_repr
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State
from multibody_sym.records import dataclass


def _by_lagrange(mechanism: Mechanism, state: State) -> TreeDynamics:
    from multibody_sym.derivation.lagrange import lagrange

    return lagrange(mechanism, state)


def _by_multipliers(mechanism: Mechanism, state: State) -> TreeDynamics:
    from multibody_sym.derivation.lagrange import multipliers

    return multipliers(mechanism, state)


@dataclass(frozen=True)
class Route:
    """A formalism: its function, what it refuses, and for how many speeds it takes seconds (None: for any number)."""

    formalism: Formalism
    most_speeds: int | None = None
    refuses_rows: bool = False
    refuses_massless: bool = False

    def refuses(self, mechanism: Mechanism) -> bool:
        """Whether the formalism has no answer for a mechanism."""
        rows = self.refuses_rows and bool(mechanism.rows)
        return rows or (self.refuses_massless and bool(massless_speeds(mechanism)))

    def is_compared(self, mechanism: Mechanism) -> bool:
        """Whether the formalism answers for a mechanism, and in seconds."""
        return not self.refuses(mechanism) and not self.is_slow(mechanism)

    def is_slow(self, mechanism: Mechanism) -> bool:
        """Whether the formalism takes more than seconds for a mechanism."""
        return self.most_speeds is not None and len(mechanism.speeds) > self.most_speeds


MANY_SPEEDS: Final = 200
"""The most speeds for which formalisms that form M in floats take seconds."""
ROUTES: Final[Mapping[str, Route]] = {
    "newton_euler": Route(newton_euler, MANY_SPEEDS),
    "dalembert_lagrange": Route(dalembert_lagrange, MANY_SPEEDS),
    "composite_body": Route(composite_body, MANY_SPEEDS),
    "block_ldl": Route(block_ldl, refuses_massless=True),
    "sweep": Route(sweep, refuses_massless=True),
    "lagrange": Route(_by_lagrange, 12, refuses_rows=True),
    "multipliers": Route(_by_multipliers, 12),
}
FORMALISMS: Final[Mapping[str, Formalism]] = {name: route.formalism for name, route in ROUTES.items()}


def verify_formalism(name: object) -> None:
    """Raise InputError unless `name` is a formalism's, or None for the cheapest."""
    if name is not None and (not isinstance(name, str) or name not in FORMALISMS):
        with at("formalism"):
            message = f"there is no formalism {short_repr(name)}"
            raise InputError(message, number="M106", word=str(name), known=FORMALISMS)


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


def formalism_name(name: str | None, mechanism: Mechanism) -> str:
    """Return the name of a formalism, that of the cheapest one for None; raises InputError."""
    if name is None:
        return cheapest(mechanism)
    verify_formalism(name)
    return name
