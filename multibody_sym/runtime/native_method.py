"""Methods of integration as the loop in C reads them."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from multibody_sym.integrators.methods.methods import Method
from multibody_sym.integrators.methods.runge_kutta import RungeKutta, Tableau
from multibody_sym.runtime.native import CollocationStruct, MethodStruct

if TYPE_CHECKING:
    from multibody_sym.integrators.methods.collocation import Collocation
    from multibody_sym.integrators.methods.multistep import Multistep


class Family(IntEnum):
    """The families of runtime.h."""

    EXPLICIT = 0
    COLLOCATION = 1
    ADAMS = 2
    STOERMER = 3
    VERLET = 4


def address(array: NDArray[Any]) -> ctypes.c_void_p:
    """Return where the elements of an array begin, for C; the array must live as long."""
    return ctypes.c_void_p(array.ctypes.data)


def method_struct(method: Method) -> MethodStruct:
    """Return the method for C; it points into the method's arrays, which must live as long.

    Modules of kinds that few runs take are imported for those.
    """
    if isinstance(method, RungeKutta):
        return _struct(Family.EXPLICIT, method, method.tableau, {})
    from multibody_sym.integrators.methods.collocation import Collocation
    from multibody_sym.integrators.methods.multistep import AdamsBashforthMoulton, Stoermer, StoermerVerlet

    if isinstance(method, Collocation):
        return _collocation(method)
    kinds = {AdamsBashforthMoulton: Family.ADAMS, Stoermer: Family.STOERMER, StoermerVerlet: Family.VERLET}
    if type(method) not in kinds:
        raise TypeError(f"{method!r} is no method")
    assert isinstance(method, (AdamsBashforthMoulton, Stoermer, StoermerVerlet))
    return _looking_back(kinds[type(method)], method)


def _collocation(method: Collocation) -> MethodStruct:
    scheme = method.scheme
    arrays = {"c": scheme.c, "w": scheme.W, "start": scheme.start, "end": scheme.end, "transform": scheme.T}
    structure = CollocationStruct(
        stages=len(scheme.c),
        **{name: address(values) for name, values in arrays.items()},
        inverse=address(scheme.T_inverse),
        gamma=scheme.gamma,
        alpha=scheme.alpha,
        beta=scheme.beta,
        filter=scheme.filter,
        error=None if scheme.error is None else address(scheme.error),
        dense=address(scheme.dense),
        hermite=scheme.hermite,
    )
    return MethodStruct(
        family=Family.COLLOCATION,
        order=method.order,
        error_order=method.error_order,
        collocation=ctypes.pointer(structure),
    )


def _looking_back(family: Family, method: Multistep) -> MethodStruct:
    weights = {name: address(values) for name, values in method.tables.items()}
    return _struct(family, method, method.starter, {"past": method.past, **weights})


def _struct(family: Family, method: Method, tableau: Tableau, more: Mapping[str, Any]) -> MethodStruct:
    return MethodStruct(
        family=family,
        stages=tableau.stages,
        all_stages=len(tableau.c),
        order=method.order,
        error_order=method.error_order,
        dense_degree=tableau.dense.shape[1],
        a=address(tableau.A),
        c=address(tableau.c),
        error=None if tableau.error is None else address(tableau.error),
        coarse_error=None if tableau.coarse_error is None else address(tableau.coarse_error),
        dense=address(tableau.dense),
        **more,
    )
