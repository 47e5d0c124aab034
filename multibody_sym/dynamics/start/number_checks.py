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

import numpy as np

from multibody_sym.dynamics.start.initial_geometry import verify_contact_values
from multibody_sym.dynamics.start.parameters import ARITHMETIC, parameter_values, undefined_text, value_or_none
from multibody_sym.dynamics.start.time_functions import verify_mass_laws, verify_motions
from multibody_sym.errors import ExpressionError, InputError, ModelError, Where, at, gathered
from multibody_sym.mechanics.mechanism import TIME, Mechanism, Source, TreeBody
from multibody_sym.mechanics.motion import body_mass, body_motion, moving_parent
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.state import State, state_of
from multibody_sym.mechanics.variable_mass import varies
from multibody_sym.model.bodies import GROUND, Body
from multibody_sym.model.constraints import Distance, Rope
from multibody_sym.model.fields import Element
from multibody_sym.model.forces import SpringDamper
from multibody_sym.model.mistakes import with_others
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System, Written, expressions, system_from_tree, tree_from_system
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, slot, symbol
from multibody_sym.scalars.rank import TYPED, null_space
from multibody_sym.scalars.vectors import ZERO_VECTOR

# ----------------------------------------------------------------------------------------------------------------------
# Masses and inertias that bodies can have, those that are welded to each other taken as one.
#
# A distribution of mass exists where neither the mass nor E = tr(J)/2 - J is negative, E the integral of r r^T dm
# about the centre of mass: then no principal moment of J is negative, and none more than the sum of the others. What
# is taken out of a body, a hole, is a body of negative mass that is welded to it.
#
# Declared inertias are often incomplete, for in the plane one moment is enough. A body that declares some of its
# moments leaves the others open, and judged is what it does about axes normal to theirs.


_ROUNDING: Final = 1e-6
"""Relative: inertias are written with few digits, and the moments of a thin plate add up exactly."""
_CANCELLED: Final = 1e-9
"""Of the masses added and taken away: nothing is left."""


@dataclass(frozen=True)
class _Part:
    """A body among those welded to each other, in the axes of the first: its mass, centre of mass and inertia about it.

    `open` (3, k): directions about which it declares no moment, though it does about others.
    """

    name: str
    mass: float
    com: Floats
    inertia: Floats
    open: Floats


def verify_masses(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError at the first body, with what is welded to it, that has a mass or inertia which no body has.

    The path ends with the field that is wrong, where it is one body's.
    """
    for parts in _welded(mechanism, parameters):
        if parts[0].name != GROUND and not _is_particle(parts):
            worst = min(parts, key=lambda part: part.mass)
            with at("bodies", worst.name if worst.mass < 0.0 else parts[0].name):
                _verify(parts)


def verify_apart(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError at the first body that can be only with what it is welded to, as a hole: alone it is no body."""
    for parts in _welded(mechanism, parameters):
        for part in parts if parts[0].name != GROUND else ():
            try:
                _verify([part])
            except ModelError:
                with at("bodies", part.name):
                    raise ModelError(
                        f"{part.name} counts only together with {parts[0].name}, to which it is welded, and absolute "
                        "coordinates move every body by itself: choose coordinates: relative",
                        number="M119",
                    ) from None


def holes(mechanism: Mechanism, parameters: Sequence[float]) -> Iterator[tuple[str, str]]:
    """Yield the bodies of negative mass, each with the first of those that it is welded to."""
    for parts in _welded(mechanism, parameters):
        yield from ((part.name, parts[0].name) for part in parts[1:] if part.mass < 0.0)


def _welded(mechanism: Mechanism, parameters: Sequence[float]) -> list[list[_Part]]:
    """Return the bodies that move, those welded to each other together."""
    still = _coordinates(mechanism, parameters), [0.0] * len(mechanism.speeds)
    state = state_of(mechanism, float, 0.0, *still, parameters, [0.0] * len(mechanism.inputs))
    groups: dict[int, list[_Part]] = {}
    first: list[int] = []
    poses: list[tuple[Floats, Floats]] = []
    for index, body in enumerate(mechanism.bodies):
        if body.steps:
            first.append(index)
            poses.append((np.eye(3), np.zeros(3)))
        else:
            onto = first[body.parent] if body.parent >= 0 else -1
            first.append(onto)
            poses.append(_pose(body, state, poses[body.parent] if onto >= 0 else (np.eye(3), np.zeros(3))))
        if first[index] >= 0:
            groups.setdefault(first[index], []).append(_part(body, state, poses[index]))
    return list(groups.values())


def _coordinates(mechanism: Mechanism, parameters: Sequence[float]) -> list[float]:
    """Return the declared coordinates (nq) where masses name them; what has no value there is zero, as all is else."""
    if not any(varies(body) for body in mechanism.bodies):
        return [0.0] * len(mechanism.coordinates)
    known = {slot("parameters", k): x for k, x in enumerate(parameters)}
    return [value_or_none(c.initial, known) or 0.0 for c in mechanism.coordinates]


def _pose(body: TreeBody, state: State, parent: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return rotation and position of a welded body, given those of its parent."""
    moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
    rotation, position = (np.array(x, dtype=float) for x in (moved.R_PB, moved.p_PB))
    return parent[0] @ rotation, parent[1] + parent[0] @ position


def _part(body: TreeBody, state: State, pose: tuple[Floats, Floats]) -> _Part:
    rotation, position = pose
    mass = body_mass(body, state)
    inertia = np.array(mass.inertia, dtype=float)
    declared = any(x is not ZERO for x in body.mass.inertia)
    missing = [k for k in range(3) if declared and body.mass.inertia[k] is ZERO]
    return _Part(
        body.name,
        float(mass.mass),
        position + rotation @ np.array(mass.com, dtype=float),
        rotation @ inertia @ rotation.T,
        rotation[:, missing],
    )


def _is_particle(parts: Sequence[_Part]) -> bool:
    """Return whether it is one body, of a mass that can be and without inertia: there is nothing to judge."""
    return len(parts) == 1 and 0.0 <= parts[0].mass < np.inf and not parts[0].inertia.any()


def _verify(parts: Sequence[_Part]) -> None:
    masses = np.array([part.mass for part in parts])
    mass, added = float(masses.sum()), float(np.abs(masses).sum())
    together = f" together with {', '.join(part.name for part in parts[1:])}" if len(parts) > 1 else ""
    whose = f"{parts[0].name}{together}"
    if mass < -_CANCELLED * added:
        advice = "correct it" if together else "a hole is welded (type: fixed) to the body that it is taken out of"
        told = ModelError(f"the mass of {whose} is {mass:g} kg; no mass is negative: {advice}", number="M109")
        raise told.under("mass")
    if not added > 0.0:
        mass = 1.0  # the centre is that of nothing
    elif mass <= _CANCELLED * added:
        _verify_balance(parts, whose)
        mass, masses = 1.0, np.full(len(parts), 1.0 / len(parts))  # any centre is as good as another
    _verify_inertia(parts, whose, (masses / mass) @ np.array([part.com for part in parts]))


def _verify_balance(parts: Sequence[_Part], whose: str) -> None:
    """Raise ModelError where masses cancel each other, but not their static moments."""
    masses, centres = np.array([part.mass for part in parts]), np.array([part.com for part in parts])
    sizes = np.abs(masses)
    amid = sizes @ centres / sizes.sum()  # about a point near, as masses cancel but for rounding
    moment = float(np.linalg.norm(masses @ (centres - amid)))
    if moment > _ROUNDING * float(sizes @ np.linalg.norm(centres, axis=1)):
        raise ModelError(
            f"the mass of {whose} is 0, but not its static moment: {moment:.6g} kg m; no body has "
            "this: correct a mass, or let the centres of mass meet",
            number="M118",
        )


def _verify_inertia(parts: Sequence[_Part], whose: str, centre: Floats) -> None:
    """Raise ModelError where inertias about a common centre of mass are no body's."""
    total, added = np.zeros((3, 3)), 0.0
    for part in parts:
        way = part.com - centre
        shift = part.mass * (way @ way * np.eye(3) - np.outer(way, way))
        total += part.inertia + shift
        added += float(np.abs(part.inertia).max() + np.abs(shift).max())
    judged = _normal(np.hstack([part.open for part in parts]))
    moments = np.linalg.eigvalsh(judged.T @ total @ judged)
    named = ", ".join(f"{x:g}" for x in moments)
    principal = "principal moments of inertia" if len(moments) == 3 else "moments of inertia"
    if moments.min(initial=0.0) < -_ROUNDING * added:
        negative = ModelError(
            f"the {principal} of {whose} are {named} kg m^2 about the centre of mass; none is negative", number="M109"
        )
        raise negative if parts[1:] else negative.under("inertia")
    if len(moments) == 3 and moments[2] - moments[1] - moments[0] > _ROUNDING * added:
        excessive = ModelError(
            f"the {principal} of {whose} are {named} kg m^2 about the centre of mass; of no body is one more than the "
            "sum of the others: correct them, or leave out those that do not matter in the plane",
            number="M118",
        )
        raise excessive if parts[1:] else excessive.under("inertia")


def _normal(directions: Floats) -> Floats:
    """Return an orthonormal basis (3, k) of what is normal to directions (3, n)."""
    return null_space(directions.T, TYPED) if directions.size else np.eye(3)


# ----------------------------------------------------------------------------------------------------------------------
# The ends of planes, which lie on them.


_OFF: Final = 1e-9
"""The part of the length of a plane up to which an end lies on it."""

Values = Mapping[Node, float]


def verify_ends(system: System, known: Values) -> None:
    """Raise ModelError at the ends of planes that do not lie on them, by values of the parameters."""
    wrong = gathered()
    for name, body in system.bodies.items():
        for path, told in _off(body, known):
            with wrong, at("bodies", name, "surfaces", *path):
                raise ModelError(told, number="M114")
    wrong.told()


def _off(body: Body, known: Values) -> Iterator[tuple[tuple[object, ...], str]]:
    """Yield the ends that do not lie on their planes, by their paths, and how far off."""
    for name, surface in body.surfaces.items():
        if surface.between is None or surface.plane is None:
            continue
        found = [_numbers(x, known) for x in (surface.plane, surface.normal, *body.ends(surface.between))]
        given = [x for x in found if x is not None]
        if len(given) < len(found) or not given[1].any():
            continue
        through, normal, *ends = given
        upward, length = normal / np.linalg.norm(normal), float(np.linalg.norm(ends[1] - ends[0]))
        for k, end in enumerate(ends):
            off = float(upward @ (end - through))
            if abs(off) > _OFF * length:
                place = ", ".join(f"{x + 0.0:.6g}" for x in end - off * upward)
                side = "above" if off > 0.0 else "below"
                told = (
                    f"this end lies {abs(off):.3g} m {side} the plane: move it along the normal, to [{place}], or "
                    "correct plane or normal"
                )
                yield (name, "between", k), told


def _numbers(place: Sequence[Node], known: Values) -> Floats | None:
    values = [value_or_none(x, known) for x in place]
    return None if None in values else np.array(values, dtype=float)


# ----------------------------------------------------------------------------------------------------------------------

F = TypeVar("F", bound=Callable[..., Any])

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
