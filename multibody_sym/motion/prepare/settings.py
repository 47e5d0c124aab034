"""The settings of a run in numbers: expressions of the file evaluated from the parameter vector, defaults filled in."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.settings import Baumgarte, Settings
from multibody_sym.motion.loop.problem import SampleTimes
from multibody_sym.motion.methods.explicit import RungeKutta
from multibody_sym.motion.methods.table import (
    AUTO,
    BY_JACOBIAN,
    COLLOCATION,
    IDA,
    INDEX_2,
    LOOKING_BACK,
    METHODS,
    MOREAU,
    LibraryMethod,
    Method,
)
from multibody_sym.program.runtime_constants import Family
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node

if TYPE_CHECKING:
    from multibody_sym.dynamics.contact.contact_problem import OneWayRows
    from multibody_sym.program.programs import Form

_LEAST_RTOL: Final = 1e-15
_LARGEST_RTOL: Final = 0.1
_RTOL: Final = 1e-9
_ATOL_BY_RTOL: Final = 0.1
_ROUNDED: Final = 1.0 + 1e-14
"""By how much the time of a sample may be beyond the end of the run, as one that is computed otherwise."""


@dataclass(frozen=True)
class Coefficients:
    """Baumgarte's alpha and beta in 1/s; None where the run chooses them."""

    alpha: float | None
    beta: float | None

    def chosen(self, own: Callable[[], float]) -> tuple[float, float]:
        """Return (alpha, beta); a missing one comes from `own()`, which makes a trial run."""
        if self.alpha is not None and self.beta is not None:
            return self.alpha, self.beta
        found = own()
        return found if self.alpha is None else self.alpha, found if self.beta is None else self.beta


@dataclass(frozen=True)
class RunSettings:
    """How a run is done: until `t_end`, with `step` fixed or by `rtol`, `atol`.

    `samples` are evenly spaced, or at times of one's own.
    `project`: each step is put back onto the constraints; `baumgarte`: they are stabilised instead.
    """

    method: Method
    t_end: float
    step: float | None
    rtol: float
    atol: float
    samples: int | SampleTimes
    project: bool
    baumgarte: Coefficients | None


def run_settings(settings: Settings, values: Mapping[Node, float]) -> RunSettings:
    """Return the settings in numbers, given the values of the parameters' symbols.

    Raises ModelError, which carries the others where several settings are wrong.
    """
    with at("simulation"):
        wrong, t_end, rtol, atol, baumgarte = gathered(), None, None, None, None
        with wrong:
            method = _method(settings)
            with wrong:
                baumgarte = _baumgarte(settings, method, values)
        with wrong:
            with at("step"):
                if settings.step is not None and (settings.rtol is not None or settings.atol is not None):
                    raise ModelError("give a step or tolerances (rtol, atol), not both", number="M117")
            step = _number("step", settings.step, values)
        with wrong:
            rtol = _rtol(settings, values)
        with wrong:
            atol = _number("atol", settings.atol, values)
        with wrong:
            t_end = _number("t_end", settings.t_end, values)
        with wrong, at("samples"):
            samples = _samples(settings.samples, values, t_end)
        wrong.told()
        assert t_end is not None
        assert rtol is not None
        declared = settings.constraints
        unwanted = declared is not None and (declared.projection is False or declared.index_2)
        project = baumgarte is None and not unwanted and not isinstance(method, LibraryMethod)
        return RunSettings(method, t_end, step, rtol, atol or rtol * _ATOL_BY_RTOL, samples, project, baumgarte)


def form_of(settings: Settings, *, constrained: bool, varies: bool = False) -> Form:
    """Return what the method asks the system for, which may be `constrained`; raises ModelError where it cannot.

    Where that `varies` from one state of the system to the next, what is asked of rows is asked where there are some.
    Only a method that ends its steps with its last stage, an implicit one, keeps rows that are part of its equations.
    IDA always takes them so unless Baumgarte's terms are asked for.
    """
    if settings.method == IDA and not (settings.constraints and settings.constraints.baumgarte):
        return "index_2" if constrained else "implicit"
    implicit = settings.method in (*COLLOCATION, *BY_JACOBIAN)
    if settings.constraints is None or not settings.constraints.index_2:
        return "implicit" if implicit else "multistep" if settings.method in LOOKING_BACK else "explicit"
    with at("simulation", "constraints", "index_2"):
        if settings.method not in INDEX_2:
            losing = " (Gauss methods lose order there)" if settings.method in COLLOCATION else ""
            able = ", ".join([*INDEX_2, IDA])
            message = f"{settings.method} cannot solve equations of index 2{losing}: take {able}, or projection"
            raise ModelError(message, number="M117")
        if not constrained and not varies:
            raise ModelError("there are no constraints to be kept: leave it out", number="M110")
    return "index_2" if constrained else "implicit"


def _method(settings: Settings) -> Method:
    name = settings.method
    with at("method"):
        if name not in METHODS:
            raise ModelError(f"there is no method {name!r}", number="M104", word=name, known=METHODS)
        method = METHODS[name]
        if settings.step is None and method.error_order == 0:
            adaptive = ", ".join(name for name, m in METHODS.items() if m.error_order > 0)
            message = f"{method.name} estimates no error and needs a step; adaptive methods: {adaptive}"
            raise ModelError(message, number="M117", word="step")
        if settings.step is not None and isinstance(method, LibraryMethod):
            message = f"{method.package}'s {method.name} chooses its steps; give rtol and atol, no step"
            raise ModelError(message, number="M117")
        return method


def _rtol(settings: Settings, values: Mapping[Node, float]) -> float:
    rtol, wrong = _number("rtol", settings.rtol, values) or _RTOL, ""
    if rtol < _LEAST_RTOL:
        wrong = f"is finer than the numbers are, which have 16 digits; ask for {_LEAST_RTOL:g} or more"
    elif rtol > _LARGEST_RTOL:
        wrong = f"lets a step err by more than a tenth of what it computes; ask for {_LEAST_RTOL:g} to "
        wrong += f"{_LARGEST_RTOL:g} (without it: {_RTOL:g})"
    if wrong:
        with at("rtol"):
            raise ModelError(f"rtol = {rtol:g} {wrong}", number="M110")
    return rtol


def _samples(asked: Node | tuple[Node, ...], values: Mapping[Node, float], t_end: float | None) -> int | SampleTimes:
    """Return the number of samples, or their times with both ends of the run."""
    if not isinstance(asked, tuple):
        number = _value(asked, values)
        if not 2 <= number < math.inf or abs(number - round(number)) > 1e-9 * number:
            message = f"expected a whole number, at least 2, or a list of times; got {number:g}"
            raise ModelError(message, number="M103")
        return round(number)
    times, end = [0.0], math.inf if t_end is None else t_end
    for k, node in enumerate(asked):
        with at(k):
            time = _value(node, values)
            if not 0.0 <= time <= end * _ROUNDED:
                message = f"t = {time:g} is not within the run, which lasts from 0 to {end:g}: drop it, or change t_end"
                raise ModelError(message, number="M109")
            if k > 0 and not time > times[-1]:
                message = f"times of samples increase; {time:g} comes after {times[-1]:g}"
                raise ModelError(message, number="M109")
            if time > 0.0:
                times.append(min(time, end))
    first = _value(asked[0], values)
    reaches = times[-1] * _ROUNDED >= end
    if reaches:
        times.pop()
    return SampleTimes((*times, end), start=first == 0.0, end=reaches)


def _number(name: str, node: Node | None, values: Mapping[Node, float]) -> float | None:
    """Return the value of a setting, which must be positive and finite."""
    if node is None:
        return None
    with at(name):
        number = _value(node, values)
        if not 0.0 < number < float("inf"):
            raise ModelError(f"expected a positive number, got {number:g}", number="M103")
        return number


def _value(node: Node, values: Mapping[Node, float]) -> float:
    try:
        return evaluate_float([node], values)[0]
    except (ArithmeticError, ValueError) as problem:
        raise ModelError(f"the expression has no value: {problem}", number="M117") from None


def stabilises(settings: Settings) -> bool:
    """Whether Baumgarte's terms are added to rows: asked for, or steps of another library's method need them."""
    if settings.constraints is not None:
        return settings.constraints.baumgarte is not None
    return settings.method != IDA and isinstance(METHODS.get(settings.method), LibraryMethod)


def _baumgarte(settings: Settings, method: Method, values: Mapping[Node, float]) -> Coefficients | None:
    """Return what is asked for; steps of another library's method cannot be put back, so that they need it anyway."""
    declared = settings.constraints
    if isinstance(method, LibraryMethod) and declared and declared.projection and declared.baumgarte is None:
        with at("constraints", "projection"):
            message = f"a step of {method.package}'s {method.name} cannot be put back onto constraints: choose "
            raise ModelError(f"{message}baumgarte, or a method that is not another library's", number="M110")
    if not stabilises(settings):
        return None
    asked = declared.baumgarte if declared else None
    if asked is None:
        return Coefficients(None, None)
    with at("constraints", "baumgarte"):
        wrong, alpha, beta = gathered(), None, None
        with wrong:
            alpha = _baumgarte_value(asked, "alpha", values)
        with wrong:
            beta = _baumgarte_value(asked, "beta", values)
        wrong.told()
        return Coefficients(alpha if alpha is not None else beta, beta if beta is not None else alpha)


def _baumgarte_value(asked: Baumgarte, name: str, values: Mapping[Node, float]) -> float | None:
    node: Node | None = getattr(asked, name)
    if node is None:
        return None
    with at(name):
        number = _value(node, values)
        if not 0.0 <= number < float("inf"):
            raise ModelError(f"expected a number that is not negative, got {number:g}", number="M103")
        return number


def method_fields(method: Method) -> dict[str, Any]:
    """Return the fields of `mbs_method`."""
    orders = {"order": method.order, "error_order": method.error_order}
    if isinstance(method, RungeKutta):
        tableau = method.tableau
        sizes = {"stages": tableau.stages, "all_stages": len(tableau.c), "dense_degree": tableau.dense.shape[1]}
        arrays = {"a": tableau.A, "c": tableau.c, "dense": tableau.dense}
        errors = {"error": tableau.error, "coarse_error": tableau.coarse_error}
        arrays |= {name: x for name, x in errors.items() if x is not None}
        return {"family": int(Family.EXPLICIT), **sizes, **orders, **arrays}
    from multibody_sym.motion.methods.multistep import Collocation  # which few models take

    assert isinstance(method, Collocation)
    scheme = method.scheme
    arrays = {"c": scheme.c, "w": scheme.W, "start": scheme.start, "end": scheme.end, "transform": scheme.T}
    arrays |= {"inverse": scheme.T_inverse, "dense": scheme.dense}
    arrays |= {} if scheme.error is None else {"error": scheme.error}
    numbers = {"gamma": scheme.gamma, "alpha": scheme.alpha, "beta": scheme.beta, "filter": scheme.filter}
    collocation = {"stages": len(scheme.c), "hermite": int(scheme.hermite), **numbers, **arrays}
    return {"family": int(Family.COLLOCATION), **orders, "collocation": collocation}


# ----------------------------------------------------------------------------------------------------------------------
# Whether a run goes by time stepping (`motion.runs.contact_steps`), and by which step.


MANY_CONTACTS: Final = 1000
"""Contacts, closed or not, of a run that goes by time stepping where neither method nor step nor tolerance is given."""
_BY_SIZE: Final = 1.6e-3
"""The part of the time in which the fastest passes the model's size, or something falls through it, that is a step."""
_OF_FORCES: Final = frozenset(
    {"acceleration", "angular_acceleration", "''", "reaction", "tension", "multiplier", "power"}
)
"""Quantities that steps do not tell: forces and accelerations at an instant."""


def steps_over_contacts(settings: Settings, declared: Mechanism) -> bool:
    """Return whether a run goes by time stepping: by the method that is asked for, or since contacts are many."""
    if settings.method == MOREAU:
        return True
    left = settings.method == AUTO and not any((settings.step, settings.rtol, settings.atol))
    many = sum(x.unilateral for x in declared.one_way) > MANY_CONTACTS
    return left and many and not any(_refused(declared).values())


def default_step(rows: OneWayRows) -> float:
    """Return the step (s) of a run that asks for none, by the contacts at its start."""
    length, gravity = rows.scale.length, np.array(rows.motion.gravity, dtype=float)
    return _BY_SIZE * length / max(rows.scale.speed, math.sqrt(float(np.linalg.norm(gravity)) * length))


def verify_contacts(declared: Mechanism) -> None:
    """Raise ModelError for what time stepping does not take."""
    for what, names in _refused(declared).items():
        if names:
            raise refusal(f"takes no {what} ({', '.join(names[:3])})")
    if not any(x.unilateral for x in declared.one_way):
        raise refusal("steps over contacts, and nothing here touches")


def refusal(why: str) -> ModelError:
    """Return the error of what time stepping does not take."""
    error = ModelError(f"method {MOREAU} {why}: choose another method", number="M117")
    error.under("method").under("simulation")
    return error


def _refused(declared: Mechanism) -> dict[str, Sequence[str]]:
    """Return what time stepping does not take, by its names."""
    parts = [part for x in declared.one_way for part in x.frictions if part.rubs]
    count = len(declared.coordinates) - len(declared.rates)
    return {
        "constraints": [row.name for row in declared.rows],
        "friction in joints": [x.name for x in declared.one_way if not x.unilateral],
        "stops that end a run": [*declared.stops, *declared.state_stops],
        "declared states": [x.name for x in declared.coordinates[count:]],
        "outputs that add up along a run": list(declared.run_outputs),
        "outputs of forces and accelerations": [
            name
            for name, value in declared.outputs.items()
            if any(leaf.data[0] in _OF_FORCES for leaf in leaves([value], "quantity"))
        ],
        "friction that is regularised": [part.name for part in parts if part.regularised is not None],
        "friction by several forces": [x.name for x in parts if x.normals != (0,) or x.wrap is not None],
        "tangential restitution": [x.name for x in declared.one_way if x.tangential_restitution is not ZERO],
    }
