"""The state and the characteristic polynomial of small motions as they are told."""

from __future__ import annotations

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.quotient_functions import doubled
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.small_motions.spectrum import Spectrum
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.start.start import Start
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, as_node, multiply, symbol

_ZERO = 1e-12


def state_told(mechanism: Mechanism, begin: Start, state: SymbolicState | None) -> dict[str, Value]:
    """Return the coordinates, and the speeds that do not vanish: formulas with their values, else numbers."""
    units = MechanismUnits(mechanism).state
    count = len(mechanism.coordinates)
    formulas = [None] * (count + len(mechanism.speeds)) if state is None else [*state.state.q, *state.state.u]
    declared: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    numbers = {each.name: x for each, x in zip(declared, (*begin.q, *begin.u), strict=True)}
    letters = {} if state is None else {node: float(letter.sample) for node, letter in state.letters.items()}
    sample = {symbol(name): x for name, x in numbers.items()} | letters
    found = {}
    for k, ((name, x), formula) in enumerate(zip(numbers.items(), formulas, strict=True)):
        node = _formula(name, formula)
        number = x if node is None else evaluate_float([node], sample)[0]
        number = 0.0 if abs(number) <= _ZERO else number
        if k < count or number:
            found[name] = Value(number, node, units[name])
    return found


def _formula(name: str, formula: object) -> Node | None:
    node = None if formula is None else as_node(formula)
    return None if node is None or node is symbol(name) else with_doubles(node)


def polynomial_text(found: Spectrum) -> str:
    """Return the factors of the polynomial that are not linear, each of which vanishes; empty where too long."""
    try:
        factors = [_factor(powers) for powers, _ in found.factors if len(powers) > 2]
    except NoClosedFormError:
        return ""
    return "; ".join(f"{factor} = 0" for factor in factors)


def _factor(powers: tuple[Quotient, ...]) -> str:
    """Return a factor by falling powers of omega."""
    parts = []
    for k in range(len(powers) - 1, -1, -1):
        if powers[k].is_zero:
            continue
        negative = powers[k].sample < 0
        size = book_form(doubled(-powers[k] if negative else powers[k]))
        term = text(size) if not k else text(multiply(size, symbol(f"omega^{2 * k}")))
        parts.append(("-" if negative else "+", term))
    first, *rest = parts
    return " ".join([first[1] if first[0] == "+" else f"-{first[1]}", *(f"{sign} {term}" for sign, term in rest)])
