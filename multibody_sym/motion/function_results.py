"""What Functions return where there are several results: tuples of arrays by name, of n states with n in front."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final, Literal, NamedTuple, TypedDict

from multibody_sym.dynamics.programs.state_functions import Axes
from multibody_sym.program.backend import Backend
from multibody_sym.scalars.arrays import Floats

ArrayName = Literal[
    "mass_matrix",
    "inverse_dynamics",
    "bias",
    "gravity",
    "coriolis_matrix",
    "reactions",
    "generalized_momenta",
    "hamiltonian",
    "acceleration",
]
"""Functions with one result."""


class FunctionKeywords(TypedDict, total=False):
    """The options of `function`."""

    given: Any
    drives: Any
    mode: Literal["found"] | Mapping[str, str] | None
    frame: str | None
    axes: Axes
    formalism: str | None
    native: bool
    backend: Backend | None


class Rates(NamedTuple):
    """Of `state_derivative`: q' (nq,), u' (nu,) and the multipliers of constraints (ns,)."""

    qdot: Floats
    udot: Floats
    multipliers: Floats


class CanonicalRates(NamedTuple):
    """Of `canonical_equations`: q' (nq,), p' (nu,) and the multipliers of constraints (ns,)."""

    qdot: Floats
    pdot: Floats
    multipliers: Floats


class HybridForces(NamedTuple):
    """Of `hybrid_dynamics`: u' (nu,) and the forces of the joints whose accelerations are given (nu,)."""

    udot: Floats
    forces: Floats


class EnergyResults(NamedTuple):
    """Of `energies`: both in J."""

    kinetic: Floats
    potential: Floats


class MomentumResults(NamedTuple):
    """Of `momentum`: linear (3,), and angular (3,) about the world's origin."""

    linear: Floats
    angular: Floats


class CentroidalMomentum(NamedTuple):
    """Of `centroidal_momentum`: linear and angular about the centre of mass (6,), and this centre (3,)."""

    momentum: Floats
    centre_of_mass: Floats


class ConstraintTerms(NamedTuple):
    """Of `constraints`: phi, phidot and gamma (ns,), and H (ns, nu)."""

    phi: Floats
    phidot: Floats
    gamma: Floats
    jacobian: Floats


class FrameMotion(NamedTuple):
    """Of `frame`: position (3,), rotation (3, 3), velocity (6,), drift (6,): its rate at udot = 0; quaternion (4,)."""

    position: Floats
    rotation: Floats
    velocity: Floats
    drift: Floats
    quaternion: Floats


class FrameJacobian(NamedTuple):
    """Of `jacobian`: J (6, nu) and its rate (6, nu)."""

    jacobian: Floats
    rate: Floats


class OperationalSpace(NamedTuple):
    """Of `operational_space`: (J M^-1 J^T)^-1 and J M^-1 J^T (6, 6)."""

    inertia: Floats
    mobility: Floats


class Regressor(NamedTuple):
    """Of `regressor`: Y (nu, 10 bodies) and theta (10 bodies)."""

    regressor: Floats
    theta: Floats


class ImpactResults(NamedTuple):
    """Of `impact`: u after it (nu,), impulses by row, in joints (joints, 6), what is positive where its mode holds."""

    after: Floats
    impulses: Floats
    joints: Floats
    holds: Floats


RESULTS: Final[Mapping[str, type[tuple[Floats, ...]]]] = {
    "state_derivative": Rates,
    "canonical_equations": CanonicalRates,
    "hybrid_dynamics": HybridForces,
    "energies": EnergyResults,
    "momentum": MomentumResults,
    "centroidal_momentum": CentroidalMomentum,
    "constraints": ConstraintTerms,
    "frame": FrameMotion,
    "jacobian": FrameJacobian,
    "operational_space": OperationalSpace,
    "regressor": Regressor,
    "impact": ImpactResults,
}
"""The types of results by the names of functions; others return an array, or a tuple of outputs by their names."""


def result_type(of: str, name: str, names: tuple[str, ...]) -> Callable[..., Any]:
    """Return the type of results with these names, of a function and of its derivatives, which have others."""
    known = RESULTS.get(of)
    return known if known is not None and known._fields == names else _result_type(name, names)  # type: ignore[attr-defined]


@cache
def _result_type(name: str, names: tuple[str, ...]) -> Callable[..., Any]:
    """Return the type of results with these names, which pickles by them."""

    def reduced(self: Any) -> tuple[Any, ...]:
        return _result, (name, names, tuple(self))

    base: Any = namedtuple(name, names, rename=True)  # type: ignore[misc]
    return type(name, (base,), {"__slots__": (), "__reduce__": reduced})


def _result(name: str, names: tuple[str, ...], values: tuple[Floats, ...]) -> Any:
    return _result_type(name, names)(*values)


def described(name: str, shape: tuple[int, ...], units: Any) -> str:
    """Return a name with its shape and its units, each once."""
    flat: list[str] = []
    waiting = [units]
    while waiting:
        each = waiting.pop(0)
        waiting[:0] = each if isinstance(each, (tuple, list)) else ()
        flat += [each] if isinstance(each, str) and each else []
    of_units = f" [{', '.join(dict.fromkeys(flat))}]" if flat else ""
    return f"{name} {shape}{of_units}" if shape else f"{name}{of_units}"
