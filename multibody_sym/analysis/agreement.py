"""Agreement: how well accelerations and multipliers of one route satisfy the equations of motion of another.

Residuals are compared, not accelerations: on long chains of thin rods two good routes differ in udot by 1e-5.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.reference import Reference, dalembert
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.kinematics.joint_forces import along_reactions
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import EPSILON, Floats
from multibody_sym.numerics.rank import ROUNDING

LARGEST_ON_TREES: Final = 10.0
LARGEST_WITH_ROWS: Final = 100.0
"""Ratios up to these are rounding; wrong equations give 1e10 and more."""


def agreement(
    mechanism: Mechanism, states: Iterable[State], formalisms: Mapping[str, Formalism]
) -> dict[str, float]:
    """Return each formalism's worst ratio over states with floats, measured with d'Alembert's principle."""
    worst = dict.fromkeys(formalisms, 0.0)
    for state in states:
        reference = dalembert(motion_of(mechanism, state))
        for name, formalism in formalisms.items():
            found = forward_dynamics(formalism(mechanism, state))
            here = ratio(reference, found.udot, found.multipliers)
            worst[name] = float(np.maximum(worst[name], here))  # which keeps nan
    return worst


def beyond_rounding(mechanism: Mechanism, ratios: Mapping[str, float]) -> list[str]:
    """Return the formalisms whose ratios are more than rounding, or no numbers."""
    largest = LARGEST_WITH_ROWS if mechanism.rows else LARGEST_ON_TREES
    return [name for name, value in ratios.items() if not value <= largest]


def ratio(reference: Reference, udot: Sequence[float] | Floats, multipliers: Sequence[float] | Floats) -> float:
    """Return the largest scaled residual of udot (n) and lambda (s) in a reference's equations of motion.

    With D = diag(M)^(-1/2) and r = M udot - (Q - c) - H^T lambda, where friction puts other forces in place of H^T
    lambda, and rows that define forces have their terms with lambda beside H udot:

        |D r| / (eps n (|D M D| |udot / D| + |D Q| + |D c| + |D H^T| |lambda|)),   norms: largest row sums,

    where |Q|, |c|, |gamma_j| are sums of absolute contributions; and for each row

        |H_j udot - gamma_j| / (eps n (|H_j D|_1 |udot / D| + |H_j| |v| + |gamma_j|)),

    where |v| is the largest that terms of one row's gamma make of udot: D^2 H_k^T |gamma_k| / |H_k D|^2.
    A row H_j that is zero but for rounding counts as long as the longest, or as what it exerts. 0/0 is 0; nan is
    returned where anything is not finite. In equilibrium udot is what the forces round to: it counts as sqrt(eps) of
    them at least.
    """
    x, multiplier = np.asarray(udot, dtype=float), np.asarray(multipliers, dtype=float)
    matrix, jacobian, exerted = reference.mass_matrix, reference.constraint_jacobian, reference.forces
    if reference.beside:
        exerted = np.array(along_reactions(exerted.tolist(), reference.beside, multiplier.tolist()), dtype=float)
    scale = 1.0 / np.sqrt(_inertia(reference))
    residual = matrix @ x - (reference.applied - reference.velocity_terms) - exerted.T @ multiplier
    forces = _norm(scale * reference.absolute_applied) + _norm(scale * reference.absolute_velocity_terms)
    forces += _row_norm(scale[:, None] * exerted.T) * _norm(multiplier)
    size = _norm(x / scale)
    inertia = _row_norm(scale[:, None] * matrix * scale) or 1.0  # without any mass rows alone resist, with 1 kg
    ratios = [_quotient(_norm(scale * residual), inertia * size + forces)]
    sizes = np.abs(jacobian * scale).sum(axis=1)
    natural = np.maximum(reference.exerted * scale.max(initial=0.0), sizes.max(initial=0.0))
    sizes = np.where(sizes <= ROUNDING * natural, natural, sizes)
    terms = reference.absolute_constraint_forcing + np.abs(jacobian) @ _answers(reference, scale)
    least = max(size, math.sqrt(EPSILON) * forces)
    defined = reference.coupling @ multiplier
    terms = terms + np.abs(reference.coupling) @ np.abs(multiplier)
    missed = np.abs(jacobian @ x + defined - reference.constraint_forcing)
    ratios += map(_quotient, missed.tolist(), (sizes * least + terms).tolist())
    return float(np.max(ratios)) / (EPSILON * max(len(x), 1))


def _answers(reference: Reference, scale: Floats) -> Floats:
    """Return the largest udot (n) that terms of one row's gamma ask for alone: what it may be rounded by."""
    weighted = np.abs(reference.constraint_jacobian) * scale * scale
    squares = (weighted * np.abs(reference.constraint_jacobian)).sum(axis=1)
    there = squares > ROUNDING**2 * squares.max(initial=0.0)
    asked = np.divide(reference.absolute_constraint_forcing, squares, out=np.zeros(len(squares)), where=there)
    found: Floats = (weighted * asked[:, None]).max(axis=0, initial=0.0)
    return found


def _inertia(reference: Reference) -> Floats:
    """Return diag(M); for a freedom without mass, what the rows that hold it make it feel."""
    diagonal = reference.mass_matrix.diagonal()
    held = (diagonal.max(initial=0.0) or 1.0) * np.square(reference.constraint_jacobian).sum(axis=0)
    return np.where(diagonal > 0.0, diagonal, held)


def _norm(x: Floats) -> float:
    return float(np.abs(x).max(initial=0.0))


def _row_norm(matrix: Floats) -> float:
    return _norm(np.abs(matrix).sum(axis=1))


def _quotient(residual: float, size: float) -> float:
    return 0.0 if residual == 0.0 else residual / size if size else np.inf
