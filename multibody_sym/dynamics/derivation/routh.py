"""Routh's reduction: coordinates that are cyclic leave the equations, and their momenta stay in them as constants.

    T = u . M u/2 + b . u + T0        R = L - sum p_c u_c = u_s . M_R u_s/2 + g . u_s - V_R
    M_R = M_ss - M_sc M_cc^-1 M_cs    g = b_s + M_sc M_cc^-1 (p - b_c)    V_R = V - T0 + (p - b_c) . M_cc^-1 (p - b_c)/2

c are the speeds that momenta replace, s those that are kept. What replaces all of them is Legendre's transformation:
then V_R is Hamilton's function H(q, p). Written once over any scalar: floats, Nodes, sympy, exact quotients.
Sources: Goldstein, Classical Mechanics, sections 8.1 and 8.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from multibody_sym.algebra.quotient_functions import exact, register_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy, split
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.masses.rates import varies
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import slot_state
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import gradient
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.ldl import factorized
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.traversal import leaves, postorder
from multibody_sym.scalars.vectors import S

_WORK = 20_000
"""How much is done to see that a derivative vanishes, in products of terms."""
_LONGEST = 4_000
"""Operations of a derivative past which only what folds to zero counts as zero."""
_NEARLY_ZERO = 1e-6
"""What rounding leaves of a derivative that vanishes, all letters being of order one."""
_UNDECIDED = frozenset({"abs", "sign", "min", "max", "where", "less", "less_equal", "table"})
"""Operations whose quotient holds on the sample's side only."""


@dataclass(frozen=True)
class EnergyTerms:
    """T by powers of the speeds, and V: `mass_matrix` M (n x n), `linear` b (n), `rest` T0, `potential` V."""

    mass_matrix: Sequence[Sequence[S]]
    linear: Sequence[S]
    rest: S
    potential: S


@dataclass(frozen=True)
class Reduction:
    """What is left when momenta p take the place of the speeds `replaced`; `kept` are the others (places both).

    `mass_matrix` M_R and `linear` g (over the kept speeds), `potential` V_R(q; p); the replaced speeds are
    `constant` + `coupling` u_s (one row each). R = u_s . M_R u_s/2 + g . u_s - V_R. `quadratic` is the part
    (p - b) . M_cc^-1 (p - b)/2 of V_R.
    """

    kept: tuple[int, ...]
    replaced: tuple[int, ...]
    mass_matrix: list[list[S]]
    linear: list[S]
    potential: S
    quadratic: S
    constant: list[S]
    coupling: list[list[S]]

    def replaced_speeds(self, kept: Sequence[S]) -> list[S]:
        """Return the speeds that momenta replace, given those that are kept."""
        return [
            c + sum((a * u for a, u in zip(row, kept, strict=True)), 0)
            for c, row in zip(self.constant, self.coupling, strict=True)
        ]


def energy_terms(mechanism: Mechanism) -> EnergyTerms:
    """Return T by powers of the speeds, and V, over Nodes in slots; b = 0, T0 = 0 where nothing moves as prescribed."""
    motion = motion_of(mechanism, slot_state(mechanism))
    kinetic = as_node(kinetic_energy(motion))
    speeds = [slot("u", k) for k in range(len(mechanism.speeds))]
    at_rest = dict.fromkeys(speeds, ZERO)
    linear = evaluate(gradient(kinetic, speeds), lambda leaf: at_rest.get(leaf, leaf))
    (rest,) = evaluate([kinetic], lambda leaf: at_rest.get(leaf, leaf))
    matrix = [[as_node(x) for x in row] for row in mass_matrix(motion)]
    return EnergyTerms(matrix, [as_node(x) for x in linear], as_node(rest), as_node(potential_energy(motion)))


def reduced(terms: EnergyTerms, replaced: Sequence[int], momenta: Sequence[S]) -> Reduction:
    """Return what is left of T and V when `momenta` p take the place of the speeds at the places `replaced`."""
    M, b = terms.mass_matrix, terms.linear
    kept = tuple(k for k in range(len(M)) if k not in set(replaced))
    factors = factorized([[M[i][j] for j in replaced] for i in replaced])
    free = [p - b[k] for p, k in zip(momenta, replaced, strict=True)]
    constant = factors.solve(free)
    columns = [factors.solve([M[i][j] for i in replaced]) for j in kept]
    return Reduction(
        kept,
        tuple(replaced),
        [[M[i][j] - _dot([M[i][k] for k in replaced], columns[n]) for n, j in enumerate(kept)] for i in kept],
        [b[i] + _dot([M[i][k] for k in replaced], constant) for i in kept],
        terms.potential - terms.rest + _dot(free, constant) / 2,
        _dot(free, constant) / 2,
        constant,
        [[-columns[n][k] for n in range(len(kept))] for k in range(len(replaced))],
    )


def _dot(a: Sequence[S], b: Sequence[S]) -> S:
    first, *others = [x * y for x, y in zip(a, b, strict=True)] or [0]
    return sum(others, first)


# --- which coordinates are cyclic ----------------------------------------------------------------------------------


def cyclic_speeds(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the places of the speeds whose coordinates are cyclic: no energy depends on these, no force acts along.

    A derivative that does not fold to zero is looked at exactly where that is soon done. Where rows restrict the tree
    nothing is cyclic here: their forces act along coordinates; nor where masses vary.
    """
    if mechanism.rows or any(varies(body) for body in mechanism.bodies):
        return ()
    motion = motion_of(mechanism, slot_state(mechanism))
    pairs = sorted((u, q) for body in mechanism.bodies for q, u in body.rate_pairs)
    lagrangian = as_node(kinetic_energy(motion) - potential_energy(motion))
    slopes = gradient(lagrangian, [slot("q", q) for _, q in pairs])
    forces = _working_forces(motion)
    return tuple(
        u for (u, _), slope in zip(pairs, slopes, strict=True) if forces[u] is ZERO and vanishes(as_node(slope))
    )


def _working_forces(motion: Motion) -> list[Node]:
    """Return the generalised forces of what V does not hold."""
    loads = split(motion.mechanism.loads)[1]
    return [as_node(x) for x in applied_generalized_forces(motion, applied(motion, loads, weight=False))]


def vanishes(expression: Node) -> bool:
    """Return whether an expression in slots is zero whatever they are, as far as exact quotients tell."""
    if expression.shadow is not None or not expression.args:
        return expression is ZERO
    order = list(postorder([expression]))
    if len(order) > _LONGEST or any(n.op in _UNDECIDED for n in order):
        return False
    field = Field(_WORK)
    known = {}
    for k, leaf in enumerate(leaves([expression], "slot", "quantity")):
        named = symbol(f"x{k}")
        known[leaf] = field.letter(named, Letter(named, PRECISE.mpf(1) / 3 + PRECISE.mpf(k) / 7))
    try:
        register_angles(field, [expression], known)
        return exact(field, [expression], known)[0].is_zero and _vanishes_on_either_side(expression)
    except NoClosedFormError:
        return False


def _vanishes_on_either_side(expression: Node) -> bool:
    """Return whether an expression is near zero where coordinates have other signs than at the sample of quotients."""
    unknown = leaves([expression], "slot", "quantity")
    for n in range(4):
        given = {
            leaf: (1.0 if leaf.data[0] == "parameters" else (-1.0) ** n) * (0.41 + 0.3 * math.cos(3.0 * k + n))
            for k, leaf in enumerate(unknown)
        }
        try:
            if not abs(evaluate_float([expression], given)[0]) < _NEARLY_ZERO:
                return False
        except (ArithmeticError, ValueError):
            continue
    return True
