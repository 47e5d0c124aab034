"""Equilibrium by virtual work: positions at which the forces do no work on any admissible displacement.

In: a System. Out: an Equilibrium with its positions, their stability, and whether they are all.

In such a position a system at rest has no acceleration. With the constraints' tangents X (see `deviations`), xi the
independent deviations, eta the independent speeds, dxi/dt = S eta, and G(xi) the accelerations deta/dt at rest,
equilibria are the roots of G, and one is stable where all eigenvalues of dG/dxi S are real and negative: for forces
with a potential V where the Hessian of V is positive definite on the admissible displacements. Friction has no part.
With one-way elements there are equilibria for each set of closed ones (`equilibrium_search`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import field, replace
from functools import singledispatch
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.analysis.deviations import DeviationFlow, coordinate_bounds, deviation_names, displaced
from multibody_sym.analysis.equilibrium_search import find_equilibria, guesses
from multibody_sym.analysis.linearize import Linearization, flow_at, linearize, place_of
from multibody_sym.analysis.positions import Positions
from multibody_sym.analysis.state_asked_about import (
    errors_at,
    friction_left_out,
    no_equilibrium_error,
    tried_sets_text,
    verify_keeps_mode,
)
from multibody_sym.derivation.routes import verify_formalism
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.start.number_checks import check_numbers, on_numbers
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.errors import ExpressionError, InputError, NoSolutionError, Where
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.declared_rows import driving_inputs
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.load_records import JointSpring, Load, PointSpring
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.points import position
from multibody_sym.model.argument_checks import door, state_by_name
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.system import System, verify_system
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.node import ZERO, Node, as_node, slot
from multibody_sym.scalars.rank import ROUNDED, exact, least_squares, rank
from multibody_sym.text.printer import text

Degree = int | None
"""None: no polynomial, or none that is seen."""
_ROUNDING: Final = 1e-9
_WAVES: Final = 64
_FEW: Final = 16
"""The largest degree whose zeros are counted, from so many values on a circle."""
_ON_CIRCLE: Final = 1e-6
_STEP: Final = 1e-4
_LINE: Final = 1e-5
TOUCHES: Final = "touches"
"""The state of a contact without force."""
_STILL: Final = 1e-6
"""The part of the largest speed of a start up to which a speed is none."""

# --- degrees of expressions, seen from how they are written: no values are tried, so that they are proved ------------


def _degree(nodes: Sequence[Node], variables: Mapping[Node, Degree], angle: Node | None = None) -> Degree:
    """Return the largest degree that expressions can have as polynomials; other leaves than variables are constants.

    With an `angle` they may be polynomials of its sin and cos.
    """
    found: dict[Node, Degree] = {}
    for n in postorder(nodes):
        parts = [found[a] for a in n.args]
        if n in variables:
            found[n] = variables[n]
        elif not n.args or all(part == 0 for part in parts):
            found[n] = 0
        else:
            found[n] = None if None in parts else _degree_of_operation(n, [part or 0 for part in parts])
            if found[n] is None and angle is not None and n.op in ("sin", "cos"):
                slope = derivative(n.args[0], angle).shadow
                found[n] = abs(int(slope)) if slope is not None and slope == int(slope) else None
    degrees = [found[node] for node in nodes]
    return None if None in degrees else max((x for x in degrees if x is not None), default=0)


def _degree_of_operation(n: Node, degrees: Sequence[int]) -> Degree:
    """Return the degree of a sum, product, quotient by a constant or whole power of polynomials."""
    if n.op in ("add", "neg"):
        return max(degrees)
    if n.op == "mul":
        return sum(degrees)
    if n.op == "div" and degrees[1] == 0:
        return degrees[0]
    exponent = n.args[1].data if n.op == "pow" and n.args[1].op == "number" else None
    return degrees[0] * exponent if isinstance(exponent, int) and exponent > 0 else None


# --- whether the positions of equilibrium that were found are all ----------------------------------------------------
#
# Forces at rest that are affine in the coordinates, with one regular root, have no other. One angle under forces that
# are a trigonometric polynomial of it has as many positions as that has zeros on the unit circle. Hinges with parallel
# axes, each body hung from the one before, under gravity alone: in the bodies' angles from the vertical V is a sum of
# cosines of one angle each, so that every body stands or hangs, in 2^n ways. The form of the forces is seen from their
# expressions, not from samples: a weak cubic term far away or a narrow pulse would escape these.


def are_all(places: Positions, found: Sequence[Floats], free: Sequence[npt.NDArray[np.bool_]]) -> bool:
    """Return whether it is proved that these positions, none of which has others beside it, are all."""
    mechanism = places.mechanism
    if not mechanism.coordinates:
        return True
    if mechanism.rows or mechanism.rates or mechanism.kinks or any(x.any() for x in free):
        return False
    if any(body.quaternions for body in mechanism.bodies):
        return False
    try:
        if _is_affine(places):
            return len(found) == 1
        if len(places.start) == 1 and places.periodic[0]:
            return len(found) == _zeros_on_circle(places)
        return len(found) == 2 ** len(places.start) and _hangs(places)
    except UNDEFINED:
        return False


def _forces(places: Positions, q: Floats) -> Floats:
    """Return the generalised forces (nu) at rest, with what prescribed motions exert."""
    motion = places.motion(q)
    return np.array(composite_body(places.mechanism, motion.state).forcing, dtype=float)


def _at_rest(places: Positions) -> Motion:
    """Return the motion at rest over Nodes, with numbers for all but the coordinates."""
    mechanism = places.mechanism
    q = [slot("q", k) for k in range(len(places.start))]
    parameters = [as_node(float(x)) for x in places.rows.parameters]
    return motion_of(mechanism, state_of(mechanism, Node, ZERO, q, [ZERO] * len(mechanism.speeds), parameters))


def _written_forces(places: Positions) -> tuple[list[Node], list[Node]]:
    """Return the generalised forces at rest as expressions, and the coordinates in them."""
    motion = _at_rest(places)
    return [as_node(x) for x in composite_body(places.mechanism, motion.state).forcing], list(motion.state.q)


def _is_affine(places: Positions) -> bool:
    """Return whether the forces at rest are affine in the coordinates, and determine them."""
    forces, coordinates = _written_forces(places)
    degree = _degree(forces, dict.fromkeys(coordinates, 1))
    if degree is None or degree > 1:
        return False
    scale = np.where(places.lengths, places.length, 1.0)
    here = _forces(places, places.start)
    slope = np.array([_forces(places, places.start + step) - here for step in np.diag(scale)])
    return rank(slope, exact(slope)) == len(here)


def _zeros_on_circle(places: Positions) -> int | None:
    """Return how many zeros the forces on one angle have, if they are a trigonometric polynomial of low degree."""
    forces, (angle,) = _written_forces(places)
    highest = _degree(forces, {angle: None}, angle)
    if highest is None or highest > _FEW:
        return None
    angles = 2 * np.pi * np.arange(_WAVES) / _WAVES
    values = np.array([_forces(places, np.array([x]))[0] for x in angles])
    waves = np.fft.fft(values) / _WAVES
    size = float(np.abs(waves).max())
    degree = max((k for k in range(highest + 1) if abs(waves[k]) > _ROUNDING * size), default=0)
    roots = np.roots([waves[k] for k in range(degree, -degree - 1, -1)])
    on_circle = np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE
    apart = np.abs(roots[:, None] - roots[None, :]) + 2.0 * np.eye(len(roots))
    return int(on_circle.sum()) if degree and apart.min() > np.sqrt(_ON_CIRCLE) else None


def _hangs(places: Positions) -> bool:
    """Return whether every coordinate turns a body about one direction, and only gravity is seen to act at rest."""
    mechanism = places.mechanism
    for body in mechanism.bodies:
        if len(body.steps) != len(body.free_steps) or [step.is_hinge for step in body.steps] not in ([], [True]):
            return False
    turning, axes = places.motion(places.start), []
    for index, (body, moved) in enumerate(zip(mechanism.bodies, turning.bodies, strict=True)):
        if body.q:
            axes.append(np.array(turning.rotation(index), dtype=float) @ np.array(moved.angular[0], dtype=float))
    if any(np.linalg.norm(np.cross(axes[0], axis)) >= _ROUNDING for axis in axes[1:]):
        return False
    motion = _at_rest(places)
    forces = applied_generalized_forces(motion, applied_forces(motion, weight=False))
    return all(as_node(x).shadow == 0 for x in forces)


# --- springs whose moving end lies beyond their other end: positions of formulas, hardly of real springs -------------


def springs_passed(places: Positions, q: Floats) -> tuple[str, ...]:
    """Return the springs that are beyond their other end in a position.

    In a joint's sliding freedom: springs whose length has another sign than unloaded. Between points: springs whose
    end moves on a line through the other and is on the other side of it than at the start.
    """
    loads = places.mechanism.loads
    return tuple(load.name for load in loads if load.spring is not None and _is_passed(load, places, q))


@singledispatch
def _is_passed(spring: Load, places: Positions, q: Floats) -> bool:
    raise TypeError(f"nothing says when {type(spring).__name__} is beyond its other end")


@_is_passed.register
def _(spring: JointSpring, places: Positions, q: Floats) -> bool:
    coordinates = places.mechanism.coordinates
    slides = all(c.unit == "m" for c in coordinates if c.joint == spring.joint)
    rest, length, stiffness = places.motion(q).state.values([spring.rest, spring.coordinate, spring.stiffness])
    return slides and stiffness != 0 and rest * length < 0 and abs(length) > _LINE * abs(rest)


@_is_passed.register
def _(spring: PointSpring, places: Positions, q: Floats) -> bool:
    return any(_points_back(places, spring, q, end.body) for end in spring.ends)


def _points_back(places: Positions, spring: PointSpring, q: Floats, body: int) -> bool:
    """Return whether a spring, seen from a body, points the other way than at the start.

    It lies on the same line there, and its ends move along this line only, whatever moves.
    """
    before, now = (_end_to_end(places, spring, x, body) for x in (places.start, q))
    sizes = np.linalg.norm(before) * np.linalg.norm(now)
    if sizes == 0.0 or before @ now >= 0.0 or np.linalg.norm(np.cross(before, now)) > _LINE * sizes:
        return False
    axis, rest = before / np.linalg.norm(before), np.zeros(len(places.mechanism.speeds))
    for x, here in ((places.start, before), (q, now)):
        for column in places.flow.tangents(x, rest).X[: len(rest)].T:
            size = float(np.abs(column).max(initial=0.0))
            if size > 0.0:
                there = _end_to_end(places, spring, displaced(places.mechanism, x, _STEP * column / size), body)
                length, aside = float(np.linalg.norm(there - here)), np.cross(axis, there - here)
                if float(np.linalg.norm(aside)) > _LINE * _STEP * max(places.length, length):
                    return False
    return True


def _end_to_end(places: Positions, spring: PointSpring, q: Floats, body: int) -> Floats:
    """Return the vector from end to end of a spring, in a body's axes."""
    motion = places.motion(q)
    ends = [np.array(position(motion, end), dtype=float) for end in spring.ends]
    found: Floats = np.array(motion.rotation(body), dtype=float).T @ (ends[1] - ends[0])
    return found


# --- the public function ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Equilibrium:
    """Positions of equilibrium, each with its coordinates by name, and whether they are stable.

    `stable` is None where a position is indifferent, and where it is `one_sided`: beside it a force has no real value.

    `free`: for each position the coordinates along which the positions beside it are equilibria too; `beyond`: the
    springs whose end lies beyond their other end. `complete`: whether it is proved that there are no others;
    `cut_short`: whether the time of the search was up before it found nothing new; `guesses`: how many it tried.
    `speeds_left_out`: speeds of the start, which is taken at rest. `units`: the unit of each coordinate. `closed`: for
    each position the contacts, ropes and stops that press or pull there, with their states, and those that touch
    without force, which may leave its stability open. `friction_left_out`: elements whose friction might hold other
    positions. `sets`: how many sets of contacts, ropes and stops were tried closed, and how many there are. `errors`:
    by how much the coordinates of each position may be wrong. `expressions`: for each position the coordinates that
    have a formula in parameters.
    """

    positions: tuple[Mapping[str, float], ...]
    stable: tuple[bool | None, ...]
    free: tuple[tuple[str, ...], ...]
    complete: bool
    beyond: tuple[tuple[str, ...], ...] = ()
    cut_short: bool = False
    guesses: int = 0
    speeds_left_out: tuple[str, ...] = ()
    one_sided: tuple[bool, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    closed: tuple[Mapping[str, str], ...] = ()
    friction_left_out: tuple[str, ...] = ()
    sets: tuple[int, int] = (1, 1)
    errors: tuple[Mapping[str, float], ...] = ()
    expressions: tuple[Mapping[str, str], ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --json` prints."""
        return {
            "positions": [dict(position) for position in self.positions],
            "stable": list(self.stable),
            "free": [list(names) for names in self.free],
            "beyond": [list(names) for names in self.beyond],
            "complete": self.complete,
            "cut_short": self.cut_short,
            "guesses": self.guesses,
            "speeds_left_out": list(self.speeds_left_out),
            "one_sided": list(self.one_sided),
            "units": dict(self.units),
            "closed": [dict(words) for words in self.closed],
            "friction_left_out": list(self.friction_left_out),
            "sets": list(self.sets),
            "errors": [dict(each) for each in self.errors],
            "expressions": [dict(each) for each in self.expressions],
        }


_MOST_LETTERED: Final = 2
"""Coordinates of a position that is looked for in letters."""


def equilibrium(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Equilibrium:
    """Return the positions of equilibrium that are found from the start and from positions all around it, at t = 0.

    Speeds of the start are ignored. Two positions differ if bodies are in other places.
    `parameters` to `project` change the system for this call. `formalism` None selects the cheapest one.
    Raises InputError, and NoSolutionError where there is no start or none is found.
    """
    return _equilibrium(Overrides(parameters, initial, inputs, coordinates, project).of(system), formalism)


@on_numbers
def _equilibrium(system: System, formalism: str | None) -> Equilibrium:
    verify_formalism(formalism)
    resolved = check_numbers(system)
    begin = start(resolved, project=system.simulation.project)
    without_friction = friction_left_out(resolved)
    if not resolved.speeds and not resolved.rates:  # nothing moves: the one position is at rest, whatever acts
        at_rest = Equilibrium(({},), (True,), ((),), True, ((),), one_sided=(False,), closed=({},), errors=({},))
        return replace(at_rest, friction_left_out=without_friction, expressions=({},))
    rested = find_equilibria(resolved, begin, formalism, project=system.simulation.project)
    found, first = rested.found, rested.first
    if not found:
        around = guesses(first.places, first.places.start)
        one_way = tried_sets_text(resolved, rested.sets, in_time=rested.cut_short)
        raise no_equilibrium_error(first.flow, first.rows, around, in_time=rested.cut_short, one_way=one_way)
    names = [c.name for c in resolved.coordinates]
    one_sided = tuple(x.search.one_sided(x.q) for x in found)
    closed = []
    for x in found:
        words = {each.name: each.words[0] for each in resolved.one_way if each.name in x.closed}
        closed.append(words | dict.fromkeys(x.touching, TOUCHES))
    # speeds of the start in coordinates of joints, as they are declared
    joints, own = resolved, begin
    if resolved.relative is not None:
        joints, own = resolved.relative, start(resolved.relative, project=system.simulation.project)
    still = _STILL * max(map(abs, own.u), default=0.0)
    return Equilibrium(
        positions=tuple(dict(zip(names, x.search.told(x.q), strict=True)) for x in found),
        stable=tuple(None if edge else x.stable for x, edge in zip(found, one_sided, strict=True)),
        free=tuple(tuple(names[k] for k in np.flatnonzero(x.free)) for x in found),
        complete=rested.sets[1] == 1 and are_all(first.places, [x.q for x in found], [x.free for x in found]),
        beyond=tuple(springs_passed(x.search.places, x.q) for x in found),
        cut_short=rested.cut_short,
        guesses=rested.guesses,
        speeds_left_out=tuple(s.name for s, u in zip(joints.speeds, own.u, strict=True) if abs(u) > still),
        one_sided=one_sided,
        units={c.name: c.unit for c in resolved.coordinates},
        closed=tuple(closed),
        friction_left_out=without_friction,
        sets=rested.sets,
        errors=tuple(dict(zip(names, x.search.errors(x.q), strict=True)) for x in found),
        expressions=tuple({} if x.free.any() else _expressions(resolved, begin, x.q) for x in found),
    )


def _expressions(resolved: Mechanism, begin: Start, q: Floats) -> dict[str, str]:
    """Return the coordinates of a position that have a formula in parameters, of few freedoms without constraints."""
    from multibody_sym.analysis.modes.matrices import formulas_of  # loads the algebra, which most positions do without
    from multibody_sym.analysis.modes.small_motion import state_values

    count = len(resolved.coordinates)
    if resolved.one_way or resolved.rows or resolved.relative is not None or count != len(resolved.speeds):
        return {}
    declared = any(entry.source is Source.DECLARED for entry in resolved.parameters)
    if count > _MOST_LETTERED or (count == 1 and not declared):  # a formula of the one coordinate has no letter then
        return {}
    there = replace(begin, q=tuple(q.tolist()), u=(0.0,) * count)
    try:
        state = formulas_of(resolved, there, found=True, places=range(count))
    except (NoClosedFormError, ExpressionError):
        return {}
    nodes = {name: value.expression for name, value in state_values(resolved, there, state).items()}
    return {name: text(node) for name, node in nodes.items() if node is not None and leaves([node], "symbol")}


# ----------------------------------------------------------------------------------------------------------------------
# Trim: the values of inputs that hold a system in a state that is given in part, so that no speed changes.


_PASSES: Final = 100
_LARGEST: Final = 0.3
"""No angle moves by more (rad) in a step, so that the position found is one near the start."""
_SMALL: Final = 1e-12
"""The part of the terms of the equations that is left of them where Newton's method has ended."""
_AT_LIMIT: Final = 1e-9
"""How near (m, rad) a limit a coordinate stands at it."""


@dataclass(frozen=True)
class Trim:
    """The `state`, in which no speed changes, and the `inputs` that hold it, in SI units."""

    state: Mapping[str, float]
    inputs: Mapping[str, float]
    system: System
    """The system with the changes of the call."""

    @door
    def linearize(self, *, formalism: str | None = None, moving: bool = False) -> Linearization:
        """Return the linearisation about this state under these inputs; options as of `mbs.linearize`.

        Raises InputError and NoSolutionError as that does.
        """
        return linearize(self.system, at=self.state, inputs=self.inputs, formalism=formalism, moving=moving)

    def as_json(self) -> dict[str, Any]:
        """Return the same as a JSON object."""
        return {"state": dict(self.state), "inputs": dict(self.inputs)}


def trim(
    system: System,
    at: Mapping[str, Any] | None = None,
    *,
    unknown: Sequence[str] | str = (),
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> Trim:
    """Return the inputs with which no speed changes where the coordinates and speeds named in `at` have these values.

    `unknown` inputs are found, all but those that drive motions if none are named; others are as declared at t = 0.
    Coordinates that `at` does not name are found as well, near the start and within the limits of joints; other speeds
    are zero, or follow from constraints. Of more unknowns than equations those of the shortest steps from the start and
    from zero. `parameters` to `inputs` change the system for this call. Contacts, ropes and friction have the mode of
    the start. Raises InputError for unknown names, NoSolutionError where nothing holds it in this mode.
    """
    verify_system(system)
    free = tuple(name for name in system.inputs if name not in driving_inputs(system))
    names = tuple(dict.fromkeys(listed_names("unknown", unknown))) or free
    for name in names:
        place_of("input", name, tuple(system.inputs))
        if name not in free:
            raise InputError(f"{name} drives a motion or a constraint, whose rates a number does not give")
    changed = Overrides(parameters, initial, inputs).of(system)
    return _trim(Overrides(inputs=dict.fromkeys(names, 0)).of(changed), at, names)


@on_numbers
def _trim(system: System, at: Mapping[str, Any] | None, names: tuple[str, ...]) -> Trim:
    given = [] if at is None else list(state_by_name("at", at))
    flow, begin = flow_at(system, None, at)
    mechanism = flow.mechanism
    held = {
        k
        for body in mechanism.bodies
        for free in body.free_steps
        for k in free.u
        if any(mechanism.coordinates[i].name in given for i in free.q)
    }
    count, bounds = len(mechanism.speeds), coordinate_bounds(mechanism, flow.parameters)
    states = [c.name for c in mechanism.coordinates if c.rate is not None]
    free = [k for k in range(count) if k not in held]
    free += [count + k for k, name in enumerate(states) if name not in given]
    q, asked = np.array(begin.q, dtype=float), [speed.name in given for speed in mechanism.speeds]
    with errors_at(at):
        _verify_within(mechanism, q, bounds, held)
        u = np.where(asked, begin.u, 0.0)
        following = flow.dependent_speeds(q, u, set(np.flatnonzero(asked).tolist()))
        q, u, w = _Search(flow, names, free, following, bounds).run(q, u)
        inputs = np.array(flow.known(q, u)[4], dtype=float)
        inputs[[list(mechanism.inputs).index(name) for name in names]] = w
        verify_keeps_mode(flow, q, u, inputs)
    every = [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]
    state = dict(zip(every, (*q.tolist(), *u.tolist()), strict=True))
    return Trim(state, dict(zip(names, w.tolist(), strict=True)), system)


def _verify_within(mechanism: Mechanism, q: Floats, bounds: Floats, held: Set[int]) -> None:
    """Raise NoSolutionError for a held coordinate past a limit of its joint."""
    for body in mechanism.bodies:
        for place, k in body.rate_pairs:
            low, high = bounds[:, k]
            if k in held and not low <= q[place] <= high:
                coordinate = mechanism.coordinates[place]
                limit = f"{low if q[place] < low else high:.6g} {coordinate.unit}".rstrip()
                message = f"{coordinate.name} = {q[place]:.6g} is past the limit of joint {coordinate.joint}, {limit}"
                raise NoSolutionError(message, number="N109")


@dataclass(frozen=True, eq=False)
class _Search:
    """Newton's method for accelerations and rates of states that are zero.

    The unknowns are deviations `free` of coordinates and, counted behind the speeds, of states, within `bounds` (2, nu)
    of coordinates; and inputs. The speeds `following` follow from the others by the rows.
    """

    flow: DeviationFlow
    names: tuple[str, ...]
    free: list[int]
    following: list[int]
    bounds: Floats

    def run(self, q: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return coordinates (nq), speeds and unknown inputs; raises NoSolutionError where none are found."""
        mechanism, places = self.flow.mechanism, [list(self.flow.mechanism.inputs).index(name) for name in self.names]
        count, values, small = len(mechanism.speeds), np.zeros(len(places)), False
        u = self._completed(q, u)
        missed, slopes = self._equations(q, u, values, places)
        values = least_squares(slopes[:, len(self.free) :], -missed, ROUNDED)  # the best inputs at the start
        for _ in range(_PASSES):
            missed, slopes = self._equations(q, u, values, places)
            size = float(np.abs(slopes).max(initial=0.0)) * max(1.0, np.abs(values).max(initial=0.0))
            step = _step_within(slopes, missed, self._room(q, len(values)))
            moved = ((k, x) for k, x in zip(self.free, step, strict=False) if k < count)
            turns = [abs(x) for k, x in moved if mechanism.speeds[k].unit == "rad/s"]
            step *= min(1.0, _LARGEST / max(turns, default=_LARGEST)) if any(turns) else 1.0
            sigma = np.zeros(count + len(mechanism.rates))
            sigma[self.free] = step[: len(self.free)]
            q, values = displaced(mechanism, q, sigma), values + step[len(self.free) :]
            u = self._completed(q, u)
            if small:  # one step more leaves rounding
                return q, u, values
            small = bool(np.abs(missed).max(initial=0.0) <= _SMALL * size)
        raise self._failed(q)

    def _failed(self, q: Floats) -> NoSolutionError:
        none = "no position was found in which"
        if self.names:
            none = f"no values of {', '.join(self.names)} were found with which"
        room, count = self._room(q, 0), len(self.flow.mechanism.speeds)
        stand = [k for k, x in zip(self.free, np.abs(room).min(axis=0), strict=True) if x <= _AT_LIMIT]
        at_limit = [deviation_names(self.flow.mechanism)[k] for k in stand if k < count]
        within = f" within the limits of {', '.join(at_limit)}" if at_limit else ""
        return NoSolutionError(
            f"{none} no speed changes there{within}; leave coordinates out of at, or name more inputs as unknown",
            where=Where(path=("at",)),
            number="N109",
        )

    def _room(self, q: Floats, inputs: int) -> Floats:
        """Return by how much the unknowns, the last of them inputs, may change down and up (2, ..)."""
        room = np.array([[-np.inf], [np.inf]]).repeat(len(self.bounds[0]) + len(self.flow.mechanism.rates), axis=1)
        for body in self.flow.mechanism.bodies:
            for place, k in body.rate_pairs:
                room[:, k] = self.bounds[:, k] - q[place]
        return np.hstack([room[:, self.free], np.array([[-np.inf], [np.inf]]).repeat(inputs, axis=1)])

    def _completed(self, q: Floats, u: Floats) -> Floats:
        """Return speeds with which the rows hold."""
        count = len(u)
        return self.flow.completed(q, u, 0.0, [count + k for k in range(count) if k not in self.following])

    def _equations(self, q: Floats, u: Floats, values: Floats, places: list[int]) -> tuple[Floats, Floats]:
        """Return accelerations, rates of states and phi, and their derivatives by the unknowns.

        Rates are divided by the largest of their derivatives: that of a pressure in Pa is 1e10 times others.
        """
        flow, count = self.flow, len(u)
        t, _, _, parameters, declared, modes = flow.known(q, u)
        inputs = np.array(declared, dtype=float)
        inputs[places] = values
        known = t, q, u, parameters, inputs, modes
        by_state, by_input = flow.derivatives(known)
        columns, following = [k if k < count else count + k for k in self.free], [count + k for k in self.following]
        of_positions, of_speeds = flow.restrictions(known)
        by_free = by_state[count:, columns]
        if following:
            moved = least_squares(of_speeds[:, following], -of_speeds[:, columns], ROUNDED)
            by_free = by_free + by_state[count:, following] @ moved
        of_rows = of_positions[:, columns]
        slopes = np.hstack([by_free, by_input[count:, places]])
        qdot, udot = flow.rates(known)
        missed = np.concatenate([udot, qdot[len(qdot) - (len(slopes) - count) :]])
        sizes = np.ones(len(missed))
        sizes[count:] = np.abs(slopes[count:]).max(axis=1, initial=0.0)
        sizes[sizes == 0.0] = 1.0
        whole = np.vstack([slopes / sizes[:, None], np.hstack([of_rows, np.zeros((len(of_rows), len(places)))])])
        return np.concatenate([missed / sizes, flow.positions(known)]), whole


def _step_within(slopes: Floats, missed: Floats, room: Floats) -> Floats:
    """Return the shortest step of Newton's method within bounds (2, ..): what would pass one ends at it."""
    step, ended = np.zeros(slopes.shape[1]), np.zeros(slopes.shape[1], dtype=bool)
    while True:
        step[~ended] = least_squares(slopes[:, ~ended], -missed - slopes[:, ended] @ step[ended], ROUNDED)
        beyond = ~ended & ((step < room[0]) | (step > room[1]))
        if not beyond.any():
            return step
        step[beyond] = np.clip(step, *room)[beyond]
        ended |= beyond
