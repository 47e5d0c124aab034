"""The numbers of a model: which expression has no finite value, or one too large or small to compute with, and where.

Arithmetic on declared values can fail anywhere in kinematics and dynamics. It is not guarded there, but where a model's
numbers come in: what fails is traced back to a declaration, and stays a defect of the program where none explains it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Any, Final, TypeVar, cast

from multibody_sym.dynamics.start.body_masses import verify_apart, verify_masses
from multibody_sym.dynamics.start.contact_starts import verify_contact_values
from multibody_sym.dynamics.start.mass_jumps import verify_mass_laws
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.smooth_motions import verify_motions
from multibody_sym.dynamics.start.surface_ends import verify_ends
from multibody_sym.dynamics.start.undefined import ARITHMETIC, undefined_text, value_or_none
from multibody_sym.errors import ExpressionError, InputError, ModelError, Where, at
from multibody_sym.model.declaration.constraints import Distance, Rope
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.declaration.file_tree import system_from_tree, tree_from_system
from multibody_sym.model.declaration.forces import SpringDamper
from multibody_sym.model.declaration.mistakes import with_others
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.system import System, Written, expressions
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.model.mechanism.parameters import Source
from multibody_sym.model.resolution.resolve import mechanism
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot, symbol
from multibody_sym.scalars.traversal import leaves, postorder

F = TypeVar("F", bound=Callable[..., Any])
Values = Mapping[Node, float]

_LARGE: Final = 1e70
"""Past which a product of a few such numbers, or of their reciprocals, has no float."""


def examined(system: System) -> Mechanism:
    """Return the mechanism of a system whose declared numbers are finite, masses possible, and prescribed motions too.

    Raises ModelError with the path of an expression of parameters that has no finite value, of a body, or of a motion
    that jumps or passes every bound before the end of the run.
    """
    with numbers_of(system):
        resolved = _resolved(system)
        base = resolved.relative or resolved
        parameters = parameter_values(base, {})
        _verify_finite(expressions(system), _parameters(base, parameters))
        with _in_shapes(system):
            verify_bodies(resolved, parameters)
        _verify_sizes(system, _parameters(base, parameters))
        verify_ends(system, _parameters(base, parameters))
        slots = {slot("parameters", k): x for k, x in enumerate(parameters)}
        verify_contact_values(base.one_way, lambda node: value_or_none(node, slots))
        values, t_end = _start(base), end_of_run(system, base, parameters)
        verify_motions(system, values, t_end)
        verify_mass_laws(system, values, t_end)
        for name, question in system.ask.items():
            with at("ask", name):
                verify_asked(question, values)
    return resolved


def _resolved(system: System) -> Mechanism:
    """Return the mechanism of a system. Raises the first mistake of its declaration, which carries the others."""
    try:
        return mechanism(system)
    except InputError as error:
        if not isinstance(system, System):
            raise
        raise with_others(error, tree_from_system(system), lambda tree: mechanism(system_from_tree(tree))) from None


def end_of_run(system: System, base: Mechanism, parameters: Sequence[float]) -> float:
    """Return t_end as declared, by values of the parameters (np); 0 where it is no time, which a run tells."""
    found = value_or_none(system.simulation.t_end, _parameters(base, parameters))
    return found if found is not None and 0.0 < found < math.inf else 0.0


def verify_asked(question: Ask, known: Values) -> None:
    """Raise ModelError where a question is about a negative time, or along a direction without length."""
    after = None if question.after is None else value_or_none(question.after, known)
    if after is not None and not after >= 0.0:
        with at("after"):
            raise ModelError("the time is negative", number="M109")
    if question.along is not None and all(value_or_none(x, known) == 0.0 for x in question.along):
        with at("along"):
            raise ModelError("the direction has no length", number="M112")


def verify_bodies(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError, with the path, at the first body or wheel that cannot be with values of the parameters.

    `parameters` in the order of the mechanism's coordinates of joints.
    """
    base = mechanism.relative or mechanism
    verify_masses(base, parameters)
    if mechanism.relative is not None:
        verify_apart(base, parameters)
    _verify_radii(base, parameters)


@contextmanager
def _in_shapes(system: System) -> Iterator[None]:
    """Let errors about the mass of a body whose shape has it name it there."""
    try:
        yield
    except ModelError as error:
        section, name, *field = error.where.path
        if section == "bodies" and field == ["mass"] and system.bodies[name].shape is not None:
            error.where = Where(path=(section, name, "shape", "mass"))
        raise


def _verify_radii(base: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError at the first rope or wheel that runs on a negative radius."""
    known = {slot("parameters", k): x for k, x in enumerate(parameters)}
    for k, row in enumerate(base.rows):
        least = min(evaluate_float(row.radii, known), default=0.0)
        if least < 0.0:
            with at(*base.row_path(k)):
                raise ModelError(f"it runs on a radius of {least:g} m, and no radius is negative", number="M109")


def _lengths(element: Element) -> tuple[str, ...]:
    """Return the fields of a constraint or a force that hold a length."""
    if isinstance(element, Distance):
        return ("value",)
    springs = isinstance(element, SpringDamper) and element.between is not None
    return ("length",) if springs or isinstance(element, Rope) else ()


def _verify_sizes(system: System, known: Values) -> None:
    """Raise ModelError at the first rod, rope or spring with a negative length, or shape with a negative size."""
    sections = {"constraints": system.constraints, "forces": system.forces}
    named = ((section, name, x) for section, elements in sections.items() for name, x in elements.items())
    lengths = ((section, name, key, getattr(x, key)) for section, name, x in named for key in _lengths(x))
    for section, name, key, length in lengths:
        value = None if length is None else value_or_none(length, known)
        if value is not None and value < 0.0:
            with at(section, name, key):
                raise ModelError(f"its length is {value:g} m, and no length is negative", number="M109")
    shapes = ((name, body.shape) for name, body in system.bodies.items() if body.shape is not None)
    for name, shape in shapes:
        for size in shape.sizes:
            value = value_or_none(size, known)
            if value is not None and value < 0.0:
                with at("bodies", name, "shape", shape.kind):
                    raise ModelError(f"a size of {value:g} m is negative", number="M109")


@contextmanager
def numbers_of(system: System) -> Iterator[None]:
    """Blame a declared number for arithmetic that fails inside, with its place; raise what none explains as it is."""
    try:
        yield
    except ARITHMETIC as failure:
        if isinstance(failure, ExpressionError) and failure.where.path:
            raise
        found = _culprit(system)
        if found is None:
            raise
        raise found from None


def blame_numbers(system: System) -> None:
    """Raise ModelError at the declared number that explains results which are not finite, if there is one."""
    found = _culprit(system)
    if found is not None:
        raise found


def on_numbers(function: F) -> F:
    """Let a function blame the numbers of its system, the first argument, for arithmetic that fails."""

    @wraps(function)
    def guarded(system: System, *arguments: Any, **named: Any) -> Any:
        with numbers_of(system):
            return function(system, *arguments, **named)

    return cast(F, guarded)


def _culprit(system: System) -> ModelError | None:
    """Return the error about the first expression without a finite value at the start, else about an extreme value."""
    declared, known = list(expressions(system)), dict[Node, float]()
    with suppress(*ARITHMETIC):  # constants are known without a mechanism
        resolved = mechanism(system)
        known = _start(resolved.relative or resolved)
    try:
        _verify_finite(declared, known)
    except ModelError as error:
        return error
    return _extreme(declared, known)


def _parameters(base: Mechanism, values: Sequence[float]) -> dict[Node, float]:
    """Return the values of declared parameters by their symbols."""
    pairs = zip(base.parameters, values, strict=True)
    return {symbol(entry.name): x for entry, x in pairs if entry.source is Source.DECLARED}


def _start(base: Mechanism) -> dict[Node, float]:
    """Return the values at the start, as declared, of what expressions may name; what has none is left out."""
    slots = {slot("parameters", k): x for k, x in enumerate(parameter_values(base, {}))}
    slots[TIME] = 0.0
    initial = {"q": [c.initial for c in base.coordinates], "u": [s.initial for s in base.speeds]}
    for array, nodes in (*initial.items(), ("inputs", list(base.inputs.values()))):
        found = {slot(array, k): value_or_none(node, slots) for k, node in enumerate(nodes)}
        slots.update({leaf: x for leaf, x in found.items() if x is not None})
    values = {name: value_or_none(node, slots) for name, node in base.symbols.items()}
    return {name: x for name, x in values.items() if x is not None}


def _verify_finite(declared: Iterable[Written], known: Values) -> None:
    """Raise ModelError at the first expression of known leaves alone that has no finite value."""
    judged = [written for written in declared if written.node.shadow is None and _is_known(written.node, known)]
    try:
        if all(map(math.isfinite, evaluate_float([written.node for written in judged], known))):
            return
    except ARITHMETIC:
        pass
    for path, node, _ in judged:
        found = value_or_none(node, known)
        if found is None or not math.isfinite(found):
            raise ModelError(undefined_text(node, known), where=Where(path=path), number="M119")


def _is_known(node: Node, known: Values) -> bool:
    return all(leaf in known for leaf in leaves([node], "symbol", "quantity"))


def _extreme(declared: Sequence[Written], known: Values) -> ModelError | None:
    """Return the error about the number farthest from 1 that is too large or too small to compute with."""
    farthest, found = math.log(_LARGE), None
    named = {leaf.data for path, node, _ in declared for leaf in leaves([node], "symbol")}
    for path, node, _ in declared:
        if path[0] == "parameters" and path[1] not in named:
            continue
        for n in postorder([node]):
            value = n.shadow if n.shadow is not None else value_or_none(n, known) if n is node else None
            if value and math.isfinite(value) and abs(math.log(abs(value))) > farthest:
                farthest, found = abs(math.log(abs(value))), (path, value)
    if found is None:
        return None
    path, value = found
    size = "large" if abs(value) > 1.0 else "small"
    message = (
        f"{value:g} is too {size} to compute with: what follows from it passes the range of floating-point numbers "
        "(1e-308 to 1e308); correct it, or choose other units for the model"
    )
    return ModelError(message, where=Where(path=path), number="M119")
