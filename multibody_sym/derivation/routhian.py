"""Routh's equations: Lagrange's, with R = L - sum p_c u_c in the place of L, for the coordinates that are not cyclic.

    d/dt dR/du - dR/dq = Q        p_c constant        u_c = M_cc^-1 (p_c - b_c - M_cs u_s)

Source: Goldstein, Classical Mechanics, section 8.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import sympy

from multibody_sym.algebra.simplify import Subexpressions, WrittenOut
from multibody_sym.derivation.hamilton import (
    MOMENTA,
    Named,
    Plain,
    common_parts,
    momentum_notation,
    named_parts,
    rubbing,
    without_rows,
)
from multibody_sym.derivation.lagrange import Energies, projected, totals, turning
from multibody_sym.derivation.legendre import Transformed, cyclic_speeds, momentum_symbols, transformed
from multibody_sym.derivation.notation import Equation, Label, Notation, Step, Symbols
from multibody_sym.derivation.prepare import Prepared, constants_step
from multibody_sym.derivation.steps import coordinate_step, energy_steps, lettered, position_steps
from multibody_sym.derivation.symbolic_equations import CanonicalEquations
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import coordinate_rates
from multibody_sym.records import dataclass

FUNCTION: Final = "Routh's function"
POTENTIAL: Final = "Effective potential"
EQUATIONS: Final = "Reduced equations"
CYCLIC: Final = "Cyclic coordinates"


@dataclass(frozen=True)
class _Found:
    """What is derived, in sympy: p_c(q, u), u_c(q, u_s; p), R, T + V, V_R, both sides of each kept speed's equation."""

    by_speeds: list[Any]
    speeds: list[Any]
    function: Any
    energy: Any
    potential: Any
    left: list[Any]
    right: list[Any]


def routh(ready: Prepared, names: Subexpressions, given: Energies) -> CanonicalEquations:
    """Return Routh's equations of a prepared mechanism; raises ModelError where no coordinate is cyclic."""
    mechanism, symbols = ready.mechanism, ready.symbols
    cyclic = cyclic_of(mechanism)
    every = momentum_symbols(mechanism, symbols)
    momenta = tuple(every[k] for k in cyclic)
    reduced = transformed(mechanism, symbols, momenta, cyclic, names)
    found = _found(mechanism, symbols, reduced, names, given)
    named, (parts, shown) = named_parts(names, (found, without_rows(given)), symbols)
    notation = momentum_notation(ready, named, every, names)
    cyclic_speeds = [symbols.speeds[k] for k in cyclic]
    speeds = dict(zip(cyclic_speeds, parts.speeds, strict=True))
    equations = (
        *(Equation(left, right) for left, right in zip(parts.left, parts.right, strict=True)),
        *(Equation(u, x) for u, x in speeds.items()),
    )
    return CanonicalEquations(
        "routh",
        **common_parts(ready, names, shown, named),
        momenta=momenta,
        function=parts.function,
        speeds=speeds,
        rates=((), ()),
        constraints=(),
        equations=equations,
        steps=lettered(_steps(ready, names, shown, parts, named, momenta, notation, equations), mechanism),
        notation=notation,
        energy=None if reduced.moves else parts.energy,
        effective_potential=parts.potential,
    )


def cyclic_of(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the speeds of cyclic coordinates. Raises ModelError where there are none, with what to do."""
    if mechanism.rows:
        others = "multipliers" if rubbing(mechanism) else "hamilton or multipliers"
        raise ModelError(
            f"{mechanism.rows[0].name!r} restricts the coordinates, and its forces act along them: Routh's equations "
            f"need independent ones; choose {others}",
            number="M120",
        )
    found = cyclic_speeds(mechanism)
    if not found:
        raise ModelError(
            "no coordinate is cyclic: energies or forces depend on every one, or act along it; choose coordinates of "
            "which one turns or moves all together, or the method hamilton",
            number="M120",
        )
    return found


def _found(
    mechanism: Mechanism, symbols: Symbols, reduced: Transformed, names: Subexpressions, given: Energies
) -> _Found:
    names.budget.enter("the reduced equations")
    left, plain = reduced.reduction, Plain(names) if isinstance(names, WrittenOut) else names
    kept = [symbols.speeds[k] for k in left.kept]
    half = [
        m * u * v / 2 for row, u in zip(left.mass_matrix, kept, strict=True) for m, v in zip(row, kept, strict=True)
    ]
    kinetic = names.sum([*half, *(g * u for g, u in zip(left.linear, kept, strict=True))])
    momenta = [
        names.sum([*(m * u for m, u in zip(row, kept, strict=True)), g])
        for row, g in zip(left.mass_matrix, left.linear, strict=True)
    ]
    rates = names.tangents(momenta, _rates(mechanism, symbols, left.kept))
    every = [sympy.S.Zero] * len(symbols.speeds)
    for k, p in zip(left.kept, momenta, strict=True):
        every[k] = p
    turned = turning(mechanism, symbols.speeds, every)
    slopes = projected(mechanism, symbols.coordinates, names.gradient(kinetic, symbols.coordinates), names)
    pulls = projected(mechanism, symbols.coordinates, reduced.gradient, plain)
    cyclic = left.replaced_speeds(kept)
    put = {symbols.speeds[k]: u for k, u in zip(left.replaced, cyclic, strict=True)}
    put = put if isinstance(names, WrittenOut) else {}
    forces = totals(given.forces, len(every))
    equations = []
    for n, k in enumerate(left.kept):
        inertia = [m * symbols.accelerations[j] for m, j in zip(left.mass_matrix[n], left.kept, strict=True)]
        velocity = names.sum([rates[n], turned[k], -slopes[k]])
        equations.append((sympy.Add(*inertia, velocity, pulls[k]), names.name(forces[k].xreplace(put))))
    by_speeds = names.gradient(given.kinetic, [symbols.speeds[k] for k in left.replaced])
    return _Found(
        by_speeds,
        [names.name(x) if not put else x for x in cyclic],
        sympy.Add(kinetic, -left.potential),
        sympy.Add(names.sum(half), left.potential),
        left.potential,
        [balance for balance, _ in equations],
        [force for _, force in equations],
    )


def _rates(mechanism: Mechanism, symbols: Symbols, kept: Sequence[int]) -> dict[Any, Any]:
    """Return the rates of t and of the coordinates of kept speeds: on the others nothing depends."""
    speeds = [u if k in kept else sympy.S.Zero for k, u in enumerate(symbols.speeds)]
    rates = coordinate_rates(mechanism, symbols.coordinates, speeds)
    return {symbols.time: 1, **dict(zip(symbols.coordinates, rates, strict=True))}


def _steps(
    ready: Prepared,
    names: Subexpressions,
    shown: Energies,
    found: _Found,
    named: Named,
    momenta: Sequence[Any],
    notation: Notation,
    equations: tuple[Equation, ...],
) -> tuple[Step, ...]:
    mechanism, symbols = ready.mechanism, ready.symbols
    by_speed = tuple(Equation(p, x) for p, x in zip(momenta, found.by_speeds, strict=True))
    return (
        coordinate_step(mechanism),
        *(() if named.definitions else position_steps(mechanism, symbols, names)),
        *energy_steps(mechanism, symbols, shown, notation),
        Step(MOMENTA, by_speed, "constant: no energy depends on these coordinates, and no force acts along them"),
        *constants_step(mechanism, symbols, ready.told.constants),
        Step(FUNCTION, (Equation(Label("R", "R"), found.function),), "by definition: R = L - p_c u_c, cyclic c"),
        Step(
            POTENTIAL,
            (Equation(Label("V_eff", r"V_{\mathrm{eff}}"), found.potential),),
            "what R holds without speeds, V - T0 + (p - b) M^-1 (p - b)/2; steady motions are where its slope is Q",
        ),
        Step(EQUATIONS, equations, "in general: d/dt dR/du - dR/dq = Q, and what the cyclic coordinates do meanwhile"),
    )
