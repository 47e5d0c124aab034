"""A problem as the loop in C reads it."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.methods.explicit import RungeKutta, Tableau
from multibody_sym.motion.methods.table import Method
from multibody_sym.program.native import CollocationStruct, MethodStruct, NativeFunction, ProblemStruct, SystemStruct
from multibody_sym.program.runtime_constants import Family
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.motion.methods.multistep import Collocation, Multistep


# ----------------------------------------------------------------------------------------------------------------------
# Methods of integration as the loop in C reads them.


def address(array: NDArray[Any]) -> ctypes.c_void_p:
    """Return where the elements of an array begin, for C; the array must live as long."""
    return ctypes.c_void_p(array.ctypes.data)


def method_struct(method: Method) -> MethodStruct:
    """Return the method for C; it points into the method's arrays, which must live as long.

    Modules of kinds that few runs take are imported for those.
    """
    if isinstance(method, RungeKutta):
        return _struct(Family.EXPLICIT, method, method.tableau, {})
    from multibody_sym.motion.methods.multistep import AdamsBashforthMoulton, Collocation, Stoermer, StoermerVerlet

    if isinstance(method, Collocation):
        return _collocation(method)
    kinds = {
        AdamsBashforthMoulton: Family.ADAMS,
        Stoermer: Family.STOERMER,
        StoermerVerlet: Family.VERLET,
    }
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


# ----------------------------------------------------------------------------------------------------------------------

Integers = NDArray[np.intc]

_PROGRAMS: Final = (
    "inputs",
    "state_derivative",
    "jacobian",
    "index_2",
    "index_2_by_state",
    "index_2_by_multipliers",
    "project_position",
    "project_velocity",
    "missed",
    "put_back",
    "normalize",
    "events",
)


class NativeProblem:
    """The structures of a problem, with all that they point into: `handle` for C, `margins` that may be written.

    `work`: doubles of room that the loop takes.
    """

    work: int

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        derivative = problem.compiled["state_derivative"]
        assert isinstance(derivative, NativeFunction)
        self.library = derivative.library
        if problem.like is None:
            self._given, self._whole = _given_arrays(problem), _whole_numbers(problem)
            self._method = method_struct(problem.method)
            self._system = _system(problem, self._given, self._whole)
            self._times = None if isinstance(problem.samples, int) else problem.times()
            self.structure = _problem(problem, self._method, self._system, self._times)
            self.work = int(self.library.mbs_work(ctypes.byref(self.structure)))
            if self.work < 0:
                raise ValueError(f"{problem.method.name} is not among the methods that the Programs were compiled for")
        else:
            self._take_over(_of(problem.like))
        self.margins = self._given[2]
        self.handle = ctypes.byref(self.structure)

    def _take_over(self, like: NativeProblem) -> None:
        """Copy the structures of a problem that differs in its numbers alone, and point them to those of this one."""
        parameters = np.array(self.problem.parameters, dtype=float)
        self._given = parameters, like._given[1], like._given[2].copy(), like._given[3]
        self._whole, self._method, self.work = like._whole, like._method, like.work
        self._system = SystemStruct.from_buffer_copy(like._system)
        self._system.parameters = parameters.ctypes.data
        if len(self._given[2]):
            self._system.margins = self._given[2].ctypes.data
        self.structure = ProblemStruct.from_buffer_copy(like.structure)
        self.structure.t0, self.structure.t_end = self.problem.t0, self.problem.t_end
        self.structure.system = ctypes.pointer(self._system)
        self._like = like  # which owns what the copies point into


def _of(problem: Problem) -> NativeProblem:
    """Return the structures of a problem that others are like."""
    found: NativeProblem | None = problem.kept.get("native")
    if found is None:
        found = problem.kept["native"] = NativeProblem(problem)
    return found


def _whole_numbers(problem: Problem) -> dict[str, Integers]:
    pairs = problem.pairing
    lists: dict[str, Sequence[Any]] = {"terminal": problem.terminal, "plain": pairs.plain, "ball": pairs.balls}
    lists["limiting"] = problem.limiting
    return {name: np.array(values, dtype=np.intc).ravel() for name, values in lists.items()}


def _given_arrays(problem: Problem) -> tuple[Floats, ...]:
    """Return parameters, modes, margins and moments, which must live as long as the system for C."""
    given = (problem.parameters, problem.modes, problem.margins, problem.moments)
    return tuple(np.array(values, dtype=float) for values in given)


def _system(problem: Problem, given: tuple[Floats, ...], whole: dict[str, Integers]) -> SystemStruct:
    """Return the system for C; it points into the arrays, which must live as long."""
    parameters, modes, margins, moments = given
    programs = {}
    for name in _PROGRAMS:
        if name in problem.compiled and (name != "inputs" or problem.inputs):
            function = problem.compiled[name]
            assert isinstance(function, NativeFunction)
            programs[name] = ctypes.addressof(function.structure)
    return SystemStruct(
        **programs,
        parameters=address(parameters),
        modes=address(modes),
        nq=len(problem.q0),
        nu=len(problem.u0),
        ns=problem.rows,
        nw=problem.inputs,
        ng=len(problem.terminal),
        plains=len(problem.pairing.plain),
        balls=len(problem.pairing.balls),
        margins=address(margins),
        switches=len(margins),
        limits=len(problem.limiting),
        moments=address(moments),
        moment_count=len(moments),
        **{name: address(values) for name, values in whole.items()},
    )


def _problem(problem: Problem, method: MethodStruct, system: SystemStruct, times: Floats | None) -> ProblemStruct:
    return ProblemStruct(
        method=ctypes.pointer(method),
        system=ctypes.pointer(system),
        step=problem.step or 0.0,
        samples=problem.sample_count,
        times=None if times is None else address(times),
        project=problem.project,
        crosses=problem.crosses,
        **{
            name: getattr(problem, name)
            for name in (
                *("t0", "t_end", "rtol", "atol"),
                *("contradiction", "closure", "independent", "whole", "max_steps"),
            )
        },
    )
