"""The numbers of a model: expressions without a finite value, numbers out of range, impossible bodies, by their paths.

Arithmetic on declared values can fail anywhere in kinematics and dynamics. It is guarded here alone: a failure is
traced back to a declaration, and is a defect of the program where no declaration explains it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
from typing import Any, Final, TypeVar, cast

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.quantities import column
from multibody_sym.dynamics.programs.system import closes_by_programs, worth_scanning
from multibody_sym.dynamics.start.parameters import (
    ARITHMETIC,
    parameter_values,
    undefined_text,
    value_or_none,
    verify_contact_values,
)
from multibody_sym.errors import ExpressionError, InputError, ModelError, Where, at, gathered
from multibody_sym.mechanics.forces import varies
from multibody_sym.mechanics.mechanism import TIME, Mechanism, Source, TreeBody
from multibody_sym.mechanics.motion import (
    State,
    arrays,
    body_mass,
    body_motion,
    motion_of,
    moving_parent,
    slot_state,
    state_of,
)
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.constraints import Distance, Rope
from multibody_sym.model.forces import SpringDamper
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System, Written, expressions, system_from_tree, tree_from_system
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate_float, substitute
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.rank import TYPED, null_space
from multibody_sym.scalars.vectors import ZERO_VECTOR

# ----------------------------------------------------------------------------------------------------------------------
# Possible masses and inertias; bodies that are welded to each other count as one.
#
# A distribution of mass exists where neither the mass nor E = tr(J)/2 - J is negative, E the integral of r r^T dm
# about the centre of mass: then no principal moment of J is negative, and none exceeds the sum of the others. A hole
# is a body of negative mass that is welded to the body around it.
#
# Declared inertias are often incomplete: in the plane one moment is enough. A body that declares some of its moments
# leaves the others open, and its inertia is judged about the axes normal to theirs.


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


def holes(mechanism: Mechanism, parameters: Sequence[float]) -> Iterator[tuple[str, str]]:
    """Yield the bodies of negative mass, each with the first of its welded group."""
    for parts in _welded_groups(mechanism, parameters):
        yield from ((part.name, parts[0].name) for part in parts[1:] if part.mass < 0.0)


def _welded_groups(mechanism: Mechanism, parameters: Sequence[float]) -> list[list[_Part]]:
    q, u = [0.0] * len(mechanism.coordinates), [0.0] * len(mechanism.speeds)
    if any(varies(body) for body in mechanism.bodies):  # masses may name coordinates
        known = {slot("parameters", k): x for k, x in enumerate(parameters)}
        q = [value_or_none(c.initial, known) or 0.0 for c in mechanism.coordinates]
    state = state_of(mechanism, float, 0.0, q, u, parameters, [0.0] * len(mechanism.inputs))
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
            parent = poses[body.parent] if onto >= 0 else (np.eye(3), np.zeros(3))
            moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
            rotation, position = (np.array(x, dtype=float) for x in (moved.R_PB, moved.p_PB))
            poses.append((parent[0] @ rotation, parent[1] + parent[0] @ position))
        if first[index] >= 0:
            groups.setdefault(first[index], []).append(_part(body, state, poses[index]))
    return list(groups.values())


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
    open_axes = np.hstack([part.open for part in parts])
    judged = null_space(open_axes.T, TYPED) if open_axes.size else np.eye(3)
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


# ----------------------------------------------------------------------------------------------------------------------
# The ends of planes, which lie on them.


_OFF: Final = 1e-9
"""The part of the length of a plane up to which an end lies on it."""

Numbers = Mapping[Node, float]


def _verify_ends(system: System, known: Numbers) -> None:
    wrong = gathered()
    surfaces = ((name, body, *pair) for name, body in system.bodies.items() for pair in body.surfaces.items())
    for of_body, body, name, surface in surfaces:
        if surface.between is None or surface.plane is None:
            continue
        vectors = (surface.plane, surface.normal, *body.ends(surface.between))
        values = [[value_or_none(x, known) for x in vector] for vector in vectors]
        if any(None in vector for vector in values) or not any(values[1]):
            continue
        through, normal, *ends = (np.array(vector, dtype=float) for vector in values)
        upward, length = normal / np.linalg.norm(normal), float(np.linalg.norm(ends[1] - ends[0]))
        for k, end in enumerate(ends):
            off = float(upward @ (end - through))
            if abs(off) > _OFF * length:
                place = ", ".join(f"{x + 0.0:.6g}" for x in end - off * upward)
                side = "above" if off > 0.0 else "below"
                with wrong, at("bodies", of_body, "surfaces", name, "between", k):
                    raise ModelError(
                        f"this end lies {abs(off):.3g} m {side} the plane: move it along the normal, to [{place}], or "
                        "correct plane or normal",
                        number="M114",
                    )
    wrong.told()


# ----------------------------------------------------------------------------------------------------------------------

F = TypeVar("F", bound=Callable[..., Any])

_LARGE: Final = 1e70
"""Past which a product of a few such numbers, or of their reciprocals, has no float."""


def check_numbers(system: System) -> Mechanism:
    """Return the mechanism of a system whose declared numbers are finite, masses possible, and prescribed motions too.

    Raises ModelError with the path of an expression of parameters that has no finite value, of a body, or of a motion
    that jumps or passes every bound before the end of the run.
    """
    with numbers_of(system):
        try:
            resolved = mechanism(system)
        except InputError as error:  # the first mistake, which carries the others
            if not isinstance(system, System):
                raise
            from multibody_sym.model.mistakes import with_others

            raise with_others(error, tree_from_system(system), lambda tree: mechanism(system_from_tree(tree))) from None
        base = resolved.relative or resolved
        parameters = parameter_values(base, {})
        known = _parameters(base, parameters)
        _verify_finite(expressions(system), known)
        with _in_shapes(system):
            verify_bodies(resolved, parameters)
        _verify_sizes(system, known)
        _verify_ends(system, known)
        slots = {slot("parameters", k): x for k, x in enumerate(parameters)}
        verify_contact_values(base.one_way, lambda node: value_or_none(node, slots))
        values, t_end = _start(base), end_of_run(system, base, parameters)
        driven = any(step.motion is not None for joint in system.joints.values() for step in joint.moves)
        varying = any(body.varying is not None or body.motion is not None for body in system.bodies.values())
        if driven or varying or system.constraints:
            from multibody_sym.dynamics.start.time_functions import verify_mass_laws, verify_motions

            verify_motions(system, values, t_end)
            verify_mass_laws(system, values, t_end)
        for name, question in system.ask.items():
            with at("ask", name):
                verify_asked(question, values)
    return resolved


def end_of_run(system: System, base: Mechanism, parameters: Sequence[float]) -> float:
    """Return t_end (s) as declared, by values of the parameters (np); 0 where it is no time, which a run reports."""
    found = value_or_none(system.simulation.t_end, _parameters(base, parameters))
    return found if found is not None and 0.0 < found < math.inf else 0.0


def verify_asked(question: Ask, known: Numbers) -> None:
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
    groups = [parts for parts in _welded_groups(base, parameters) if parts[0].name != GROUND]
    for parts in groups:
        first, worst = parts[0], min(parts, key=lambda part: part.mass)
        is_particle = len(parts) == 1 and 0.0 <= first.mass < np.inf and not first.inertia.any()
        if not is_particle:
            with at("bodies", worst.name if worst.mass < 0.0 else first.name):
                _verify(parts)
    for first, part in ((parts[0], part) for parts in groups for part in parts if mechanism.relative is not None):
        try:  # by itself
            _verify([part])
        except ModelError:
            with at("bodies", part.name):
                raise ModelError(
                    f"{part.name} counts only together with {first.name}, to which it is welded, and absolute "
                    "coordinates move every body by itself: choose coordinates: relative",
                    number="M119",
                ) from None
    known = {slot("parameters", k): x for k, x in enumerate(parameters)}
    for k, row in enumerate(base.rows):  # ropes and wheels
        least = min(evaluate_float(row.radii, known), default=0.0)
        if least < 0.0:
            with at(*base.row_path(k)):
                raise ModelError(f"it runs on a radius of {least:g} m, and no radius is negative", number="M109")


@contextmanager
def _in_shapes(system: System) -> Iterator[None]:
    """Place errors about a mass that is declared with a body's shape there."""
    try:
        yield
    except ModelError as error:
        section, name, *field = error.where.path
        if section == "bodies" and field == ["mass"] and system.bodies[name].shape is not None:
            error.where = Where(path=(section, name, "shape", "mass"))
        raise


def _verify_sizes(system: System, known: Numbers) -> None:
    """Raise ModelError at the first rod, rope or spring with a negative length, or shape with a negative size."""
    declared = (("constraints", system.constraints), ("forces", system.forces))
    for section, name, x in ((section, *pair) for section, elements in declared for pair in elements.items()):
        key = "value" if isinstance(x, Distance) else "length"
        has_length = isinstance(x, Distance | Rope) or (isinstance(x, SpringDamper) and x.between is not None)
        length = getattr(x, key) if has_length else None
        value = None if length is None else value_or_none(length, known)
        if value is not None and value < 0.0:
            with at(section, name, key):
                raise ModelError(f"its length is {value:g} m, and no length is negative", number="M109")
    for name, body in system.bodies.items():
        for size in body.shape.sizes if body.shape is not None else ():
            value = value_or_none(size, known)
            if value is not None and value < 0.0 and body.shape is not None:
                with at("bodies", name, "shape", body.shape.kind):
                    raise ModelError(f"a size of {value:g} m is negative", number="M109")


@contextmanager
def numbers_of(system: System) -> Iterator[None]:
    """Blame a declared number for arithmetic that fails inside, with its path; reraise a failure that none explains."""
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
    """Decorate a function whose first argument is a System with `numbers_of`."""

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
    pairs = zip(base.parameters, values, strict=True)
    return {symbol(entry.name): x for entry, x in pairs if entry.source is Source.DECLARED}


def _start(base: Mechanism) -> dict[Node, float]:
    """Return the declared values at the start of the symbols that expressions may name, if they have values."""
    slots = {slot("parameters", k): x for k, x in enumerate(parameter_values(base, {}))}
    slots[TIME] = 0.0
    initial = {"q": [c.initial for c in base.coordinates], "u": [s.initial for s in base.speeds]}
    for array, nodes in (*initial.items(), ("inputs", list(base.inputs.values()))):
        found = {slot(array, k): value_or_none(node, slots) for k, node in enumerate(nodes)}
        slots.update({leaf: x for leaf, x in found.items() if x is not None})
    values = {name: value_or_none(node, slots) for name, node in base.symbols.items()}
    return {name: x for name, x in values.items() if x is not None}


def _verify_finite(declared: Iterable[Written], known: Numbers) -> None:
    """Raise ModelError at the first expression of known leaves alone that has no finite value."""
    judged = [
        written
        for written in declared
        if written.node.shadow is None and all(leaf in known for leaf in leaves([written.node], "symbol", "quantity"))
    ]
    try:
        if all(map(math.isfinite, evaluate_float([written.node for written in judged], known))):
            return
    except ARITHMETIC:
        pass
    for path, node, _ in judged:
        found = value_or_none(node, known)
        if found is None or not math.isfinite(found):
            raise ModelError(undefined_text(node, known), where=Where(path=path), number="M119")


def _extreme(declared: Sequence[Written], known: Numbers) -> ModelError | None:
    """Return the error about the number farthest from 1, where it is too large or too small to compute with."""
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


# ----------------------------------------------------------------------------------------------------------------------
# A quick look at the numbers of a start: a Program that clears those with which nothing can be wrong.
#
# It serves trees with free joints and without one-way elements, which start as declared. It reports no mistakes:
# numbers that it does not clear, and starts whose runs fail, are checked in full (`number_checks`, `start`). It is
# stricter than the full checks, so that rounding does not let it clear what they refuse.


FINITE, POSITIVE = "finite", "positive"
_DEFINED: Final = frozenset("neg add mul abs sign min max sin cos atan tanh asinh table".split())
"""Operations that have a value for all finite numbers; the results of others are checked."""
_MOMENT_ROUNDING: Final = 1e-7
"""Relative: so far a moment of inertia may miss a possible one; the full check allows ten times more."""
_PIVOT: Final = 1e-9
"""Beside its diagonal element, the least pivot of a mass matrix that is cleared."""


def is_plain(mechanism: Mechanism) -> bool:
    """Return whether a mechanism starts as declared, whatever its numbers are, or not at all."""
    measured = (entry.value is None for entry in mechanism.parameters)
    return not mechanism.rows and not mechanism.cuts and not any(measured) and _is_plain_but_for_rows(mechanism)


def is_plain_but_for_loops(system: System, mechanism: Mechanism) -> bool:
    """Return whether a mechanism is plain but for rows that Programs close and that do not depend on time."""
    if not closes_by_programs(mechanism) or not _is_plain_but_for_rows(mechanism) or mechanism.inputs:
        return False
    if is_driven(mechanism):
        return False
    measured = any(entry.measure is not None for entry in mechanism.parameters)
    wheels = any(list(row.radii) for row in mechanism.rows)
    written = [each.node for each in expressions(system) if each.path[0] == "constraints"]
    return not measured and not wheels and symbol("t") not in leaves(written, "symbol")


def is_driven(mechanism: Mechanism) -> bool:
    return any(any(body.given) for body in mechanism.bodies)


def _is_plain_but_for_rows(mechanism: Mechanism) -> bool:
    special = (mechanism.one_way, mechanism.relative, mechanism.impact, mechanism.mode)
    odd = (body.is_foot or body.is_double or varies(body) for body in mechanism.bodies)
    return not any(special) and not any(odd) and not massless_speeds(mechanism)


def quick_look(system: System, mechanism: Mechanism) -> Program:
    """Return (t, q, u, parameters, ..) -> `finite`, `positive` for a plain mechanism.

    Numbers are cleared that make all values of both finite, and those of `positive` greater than zero.
    """
    trace = Trace("quick_look", arrays(mechanism))
    finite = list(dict.fromkeys(_partial_values(system, mechanism))) or [ZERO]
    positive: list[Node] = []
    for body in mechanism.bodies:
        if body.mass.mass is not ZERO:
            positive.append(body.mass.mass)
        if any(x is not ZERO for x in body.mass.inertia):
            positive.extend(_inertia_minors(body.mass.inertia))
    like = worth_scanning(mechanism)
    if like is None:
        motion = motion_of(mechanism, slot_state(mechanism))
        diagonals = zip(tree_factors(motion).pivots, mass_diagonal(motion), strict=True)
        positive += [as_node(pivot) - _PIVOT * diagonal for pivot, diagonal in diagonals]
    else:  # by one pass inward: a long tree compiles for seconds
        from multibody_sym.dynamics.programs.repeated_bodies import scanned_pivots

        positive += scanned_pivots(mechanism, like, trace, _PIVOT)
    positive = positive or [as_node(1)]
    return trace.finish({FINITE: column(finite), POSITIVE: column(positive)})


def _partial_values(system: System, mechanism: Mechanism) -> Iterator[Node]:
    """Yield the parts of written expressions that may have no value at the start, and their values."""
    inputs = {slot("inputs", k): node for k, node in enumerate(mechanism.inputs.values())}
    known = {**mechanism.symbols, TIME: ZERO}
    for written in expressions(system):
        named = leaves([written.node], "symbol", "quantity")
        if written.node.shadow is not None or not all(leaf in mechanism.symbols for leaf in named):
            continue
        node = substitute(written.node, known)
        while any(leaf in inputs for leaf in leaves([node], "slot")):
            node = substitute(node, inputs)
        node = substitute(node, known)
        yield from (n for n in postorder([node]) if n.args and n.shadow is None and n.op not in _DEFINED)
        if node.shadow is None:
            yield node


def _inertia_minors(six: Sequence[Node]) -> Iterator[Node]:
    """Yield minors that are positive where an inertia is possible: of E = tr(J)/2 - J, or of J about declared axes.

    A little is added for flat bodies.
    """
    xx, yy, zz, xy, xz, yz = six
    trace = xx + yy + zz
    declared = [k for k in range(3) if six[k] is not ZERO]
    J = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    little = _MOMENT_ROUNDING * trace
    if len(declared) == 3:
        J = [[(trace / 2 - x if j == k else -x) for k, x in enumerate(row)] for j, row in enumerate(J)]
    m = [[J[j][k] + little if j == k else J[j][k] for k in declared] for j in declared]
    if m:
        yield m[0][0]
    if len(m) > 1:
        yield m[0][0] * m[1][1] - m[0][1] * m[1][0]
    if len(m) > 2:
        yield (
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        )
    if not m:
        yield as_node(-1)
