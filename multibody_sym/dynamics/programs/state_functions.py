"""What can be asked of a system at a state, each as one Program with named outputs.

Inputs of all are t, q, u, parameters, inputs, modes as of every system Program; `udot` follows where it is read.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl, hybrid_dynamics, tree_factors
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, mass_matrix, needed_wrenches
from multibody_sym.dynamics.formalisms.constrained import PASSES
from multibody_sym.dynamics.formalisms.equations import Formalism, massless_speeds, verify_massive
from multibody_sym.dynamics.programs.function_derivatives import directions, rates_along
from multibody_sym.dynamics.programs.quantities import (
    MOMENTA,
    angular_momentum,
    body_momenta,
    centre_marker,
    centre_of_mass,
    column,
    generalized_momenta,
    momentum,
    with_quantities,
)
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.system import (
    constrained_motion,
    energy_program,
    inputs_program,
    sources_of,
    state_derivative,
)
from multibody_sym.errors import InputError, ModelError, NoSolutionError, at
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces, varies
from multibody_sym.mechanics.mechanism import INDEPENDENT, Mechanism, verify_without_states
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    accelerations,
    arrays,
    coordinate_rates,
    joint_rates,
    motion_of,
    slot_state,
    spread,
    state_of,
    turning_momenta,
)
from multibody_sym.mechanics.points import (
    NO_WRENCH,
    Wrench,
    acceleration,
    axes,
    carried_wrenches,
    joint_projection,
    position,
    velocity,
)
from multibody_sym.mechanics.row_kinematics import acting_rows, along_reactions, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import COM
from multibody_sym.program.derivatives import callee_value, jacobian_along, resume_trace
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import gradient
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, real, slot
from multibody_sym.scalars.rank import ROUNDED, null_space, rank
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    negate,
    rotation_quaternion,
    subtract,
)
from multibody_sym.text.printer import COMPONENTS

Axes = Literal["world", "local", "local_world_aligned"]
"""Axes and reference point of velocities: of the world at its origin, of the body at its point, of the world at it."""
Outputs = dict[str, tuple[tuple[int, ...], list[Node]]]
"""Name -> shape and elements, row by row."""


@dataclass(frozen=True)
class FunctionOptions:
    """Options of functions: joints with `given` accelerations, joints as `drives`, a `frame` and its `axes`."""

    formalism: Formalism
    given: tuple[str, ...] = ()
    drives: tuple[str, ...] = ()
    frame: str | None = None
    axes: Axes = "world"


StateFunction = Callable[[Mechanism, FunctionOptions], Program]

# ----------------------------------------------------------------------------------------------------------------------
# Functions of t, q, u.


def _at_state(name: str, outputs: Callable[[Motion, FunctionOptions], Outputs]) -> StateFunction:
    """Return the function whose outputs follow from the motion alone."""
    return lambda mechanism, options: Trace(name, arrays(mechanism)).finish(
        outputs(motion_of(mechanism, slot_state(mechanism)), options)
    )


def _with_udot(name: str, mechanism: Mechanism) -> Trace:
    """Return a Trace to which accelerations are given, too."""
    return Trace(name, (*arrays(mechanism), Array("udot", (len(mechanism.speeds),))))


def _matrix(rows: Sequence[Sequence[S]], columns: int) -> tuple[tuple[int, ...], list[Node]]:
    return (len(rows), columns), [as_node(x) for row in rows for x in row]


def _state_derivative(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return -> qdot (nq), udot (nu), multipliers (ns)."""
    whole = state_derivative(mechanism, options.formalism(mechanism, slot_state(mechanism)))
    trace = Trace("state_derivative", arrays(mechanism))
    names = [output.name for output in whole.outputs][:3]
    found = trace.call(whole, [trace[array.name] for array in whole.inputs])
    return trace.finish({name: column(values) for name, values in zip(names, found, strict=False)})


def _inverse_dynamics(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return (.., udot) -> forces (nu): M udot + c - Q, the forces that the accelerations need on top of the loads.

    They are those of all joints, or of the `drives`; where rows only define forces, as of friction in joints, all
    joints are driven. Raises ModelError where rows restrict the tree, whose forces are not determined.
    """
    drives = options.drives
    if mechanism.rows and not drives and not any(row.restricts for row in mechanism.rows):
        drives = tuple(body.joint_name for body in mechanism.bodies if body.u)
    if mechanism.rows and drives:
        return driven_dynamics_program(mechanism, drives)
    _verify_tree(mechanism, "say which joints are driven (function(.., drives=[..])), ")
    trace = _with_udot("inverse_dynamics", mechanism)
    motion = economical_motion(mechanism, slot_state(mechanism))
    return trace.finish({"forces": column(_needed_forces(motion, trace["udot"]))})


def _bias(motion: Motion, _: FunctionOptions) -> Outputs:
    """Return -> bias (nu): c of M udot + c = Q, of velocities and weight, without applied loads."""
    of_velocities = inverse_dynamics(motion, [0] * len(motion.state.u))
    return {"bias": column(a + b for a, b in zip(of_velocities, _weight(motion), strict=True))}


def _weight(motion: Motion) -> list[S]:
    return [-x for x in applied_generalized_forces(motion, applied_forces(motion, ()))]


def _momentum(motion: Motion, _: FunctionOptions) -> Outputs:
    """Return -> linear (3), angular (3): the momentum of all bodies, about the world's origin."""
    parts = body_momenta(motion)
    return {"linear": column(momentum(parts)), "angular": column(angular_momentum(parts))}


def _centroidal_momentum(motion: Motion, _: FunctionOptions) -> Outputs:
    """Return -> momentum (6), linear and about the centre of mass, and centre_of_mass (3)."""
    parts = body_momenta(motion)
    centre = centre_of_mass(parts)
    both = [*momentum(parts), *angular_momentum(parts, centre)]
    return {"momentum": column(both), "centre_of_mass": column(centre)}


def _coriolis_matrix(mechanism: Mechanism, _: FunctionOptions) -> Program:
    """Return -> coriolis_matrix C (nu, nu) by Christoffel's symbols: c = C u + gravity, and M' - 2 C is skew.

    Raises ModelError where speeds are no rates of coordinates, or where masses vary or motions are prescribed.
    """
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    count = len(mechanism.speeds)
    prescribed = any(varies(body) or any(x is not None for x in body.given) for body in mechanism.bodies)
    if len(pairs) < count or prescribed:
        raise ModelError(
            "Christoffel's symbols are those of coordinates whose rates are the speeds, without prescribed motions; "
            "bias has the terms of velocities of any model",
            number="M110",
        )
    slopes = jacobian_along(mass_matrix_program(mechanism), directions(mechanism, "q"), name="mass_matrix_by_q")
    trace = resume_trace(slopes, "coriolis_matrix", ())
    values, u = slopes.outputs[0].values, trace["u"]

    def slope(i: int, j: int, k: int) -> Node:
        return values[(i * count + j) * count + k]

    matrix = [
        [
            sum(((slope(i, j, k) + slope(i, k, j) - slope(j, k, i)) * u[k] for k in range(count)), ZERO) / 2
            for j in range(count)
        ]
        for i in range(count)
    ]
    return trace.finish({"coriolis_matrix": _matrix(matrix, count)})


def _regressor(mechanism: Mechanism, _: FunctionOptions) -> Program:
    """Return (.., udot) -> regressor Y (nu, 10 bodies), theta (10 bodies): Y theta = M udot + c.

    Of each body in tree order: m, m c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz about its origin, along its axes.
    Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics (2009), 7.2.2.
    """
    trace = _with_udot("regressor", mechanism)
    motion = motion_of(mechanism, slot_state(mechanism))
    reached = accelerations(motion, trace["udot"], negate(motion.gravity))
    columns: list[list[S]] = []
    theta: list[S] = []
    for index, (moved, mass, (a, alpha)) in enumerate(zip(motion.bodies, motion.masses, reached, strict=True)):
        for wrench in _unit_wrenches(moved.w_WB, a, alpha):
            of_body = [wrench if k == index else NO_WRENCH for k in range(len(reached))]
            columns.append(joint_projection(motion, carried_wrenches(motion, of_body)))
        c, square = mass.com, dot(mass.com, mass.com)
        moments = (mass.inertia[i][j] + mass.mass * (square * int(i == j) - c[i] * c[j]) for i, j in _INERTIA)
        theta += [mass.mass, *(mass.mass * x for x in c), *moments]
    rows = [[column[k] for column in columns] for k in range(len(mechanism.speeds))]
    return trace.finish({"regressor": _matrix(rows, len(columns)), "theta": column(theta)})


_INERTIA: Final = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def _unit_wrenches(w: Vec, a: Vec, alpha: Vec) -> Iterator[Wrench]:
    """Yield what a body needs about its origin for one of its ten parameters alone."""
    yield a, ZERO_VECTOR
    turned = spread(alpha, w)
    axes: list[Vec] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    for axis in axes:
        yield apply(turned, axis), cross(axis, a)
    for i, j in _INERTIA:
        unit = [[int((r, c) in ((i, j), (j, i))) for c in range(3)] for r in range(3)]
        inertia: Mat = tuple(tuple(row) for row in unit)  # type: ignore[assignment]
        yield ZERO_VECTOR, add(apply(inertia, alpha), cross(w, apply(inertia, w)))


def _constraints(motion: Motion, _: FunctionOptions) -> Outputs:
    """Return -> phi, phidot, gamma (ns) and jacobian H (ns, nu): phi = 0, H u + phi_t = 0, H udot = gamma."""
    rows = row_motions(motion)
    return {
        "phi": column(row.gap for row in rows),
        "phidot": column(row.phidot for row in rows),
        "gamma": column(row.gamma for row in rows),
        "jacobian": _matrix([row.jacobian for row in rows], len(motion.mechanism.speeds)),
    }


def _reactions(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return -> reactions (joints, 6): of each joint fx .. mz on its child, about the child's joint point."""
    trace = Trace("reactions", arrays(mechanism))
    whole = _state_derivative(mechanism, options)
    _, udot, multipliers = trace.call(whole, [trace[array.name] for array in whole.inputs])
    motion = motion_of(mechanism, slot_state(mechanism))
    found = reactions(motion, udot, row_motions(motion), multipliers)
    rows = [[found[joint][component] for component in COMPONENTS] for joint in mechanism.joint_names]
    return trace.finish({"reactions": _matrix(rows, len(COMPONENTS))})


def outputs_of_function(mechanism: Mechanism, options: FunctionOptions, *, together: bool = False) -> Program:
    """Return -> the declared outputs by their names, or `together` -> values (k), in their order."""
    trace = Trace("outputs", arrays(mechanism))
    whole = state_derivative(mechanism, options.formalism(mechanism, slot_state(mechanism)))
    values = with_quantities(trace, sources_of(mechanism, whole), list(mechanism.outputs.values()))
    by_name: Outputs = {name: ((), [x]) for name, x in zip(mechanism.outputs, values, strict=True)}
    return trace.finish({"values": column(values)} if together else by_name)


# ----------------------------------------------------------------------------------------------------------------------
# Frames: bodies, their points and named frames.


def _frame(motion: Motion, options: FunctionOptions) -> Outputs:
    """Return -> position (3), rotation (3, 3), velocity (6), drift (6): its rate at udot = 0, quaternion (4)."""
    moved = _Moved.of(motion, options)
    return {
        "position": column(moved.position),
        "rotation": _matrix(moved.rotation, 3),
        "velocity": column(moved.velocity_in(options.axes)),
        "drift": column(moved.acceleration_in(options.axes)),
        "quaternion": column(rotation_quaternion(moved.rotation)),
    }


def _acceleration(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return (.., udot) -> acceleration (6) of a frame: J udot + its drift."""
    trace = _with_udot("acceleration", mechanism)
    moved = _Moved.of(motion_of(mechanism, slot_state(mechanism)), options, trace["udot"])
    return trace.finish({"acceleration": column(moved.acceleration_in(options.axes))})


def _jacobian(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return -> jacobian J (6, nu), rate J' (6, nu): velocity = J u + its prescribed part."""
    state = slot_state(mechanism)
    velocities = _Moved.of(motion_of(mechanism, state), options).velocity_in(options.axes)
    twist = Trace("twist", arrays(mechanism)).finish({"jacobian": column(velocities)})
    jacobian = jacobian_along(twist, directions(mechanism, "u"), name="columns")
    onward = {"t": (ONE,), "q": rates_along(mechanism, state.u)}
    rate = jacobian_along(jacobian, [onward], name="rates")
    trace = Trace("jacobian", arrays(mechanism))
    given = [trace[array.name] for array in jacobian.inputs]
    shape = jacobian.output("jacobian").shape
    (columns,), (rates,) = trace.call(jacobian, given), trace.call(rate, given)
    return trace.finish({"jacobian": (shape, list(columns)), "rate": (shape, list(rates))})


def _operational_space(mechanism: Mechanism, options: FunctionOptions) -> Program:
    """Return -> mobility J M^-1 J^T (6, 6) of a frame, and its inverse: the operational-space inertia (6, 6).

    Both are those of the tree, whatever its rows. The inertia is not finite where fewer than six directions are free,
    as with fewer than six speeds.
    Source: O. Khatib, A unified approach for motion and force control of robot manipulators (1987).
    """
    jacobian = _jacobian(mechanism, options)
    trace = Trace("operational_space", arrays(mechanism))
    columns = trace.call(jacobian, [trace[array.name] for array in jacobian.inputs])[0]
    count, factors = len(mechanism.speeds), tree_factors(motion_of(mechanism, slot_state(mechanism)))
    rows = [factors.weighted(columns[k * count : (k + 1) * count]) for k in range(6)]
    mobility = [[as_node(sum(x * y for x, y in zip(a, b, strict=True))) for b in rows] for a in rows]
    return trace.finish({"inertia": _matrix(_inverse(mobility), 6), "mobility": _matrix(mobility, 6)})


def _inverse(matrix: Sequence[Sequence[Node]]) -> list[list[Node]]:
    """Return the inverse of a positive definite matrix, which needs no pivots."""
    size = len(matrix)
    rows = [[*row, *(ONE if i == k else ZERO for i in range(size))] for k, row in enumerate(matrix)]
    for k in range(size):
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(size):
            if i != k:
                factor = rows[i][k]
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[size:] for row in rows]


def _marker(mechanism: Mechanism, options: FunctionOptions) -> Marker:
    name = options.frame
    if name is None:
        raise InputError('which frame? Say frame="body", "body.point", "body.com" or the name of a frame.')
    if name in mechanism.markers:
        return mechanism.markers[name]
    centre = centre_marker(mechanism, name.removesuffix(f".{COM}")) if name.endswith(f".{COM}") else None
    if centre is None:
        raise InputError(f"there is no frame {name!r}", number="M106", word=name, known=mechanism.markers)
    return centre


@dataclass(frozen=True)
class _Moved:
    """The place and motion of a frame in world axes: of its origin, and angular."""

    position: Vec
    rotation: Mat
    velocity: tuple[Vec, Vec]
    acceleration: tuple[Vec, Vec]

    @staticmethod
    def of(motion: Motion, options: FunctionOptions, udot: Sequence[S] | None = None) -> _Moved:
        """Return those of the frame that is asked for; `udot` None is zero."""
        marker = _marker(motion.mechanism, options)
        of_body = motion.rotation(marker.body)
        bodies = accelerations(motion, [0] * len(motion.state.u) if udot is None else udot)
        turning = motion.bodies[marker.body].w_WB if marker.body >= 0 else ZERO_VECTOR
        growing = bodies[marker.body][1] if marker.body >= 0 else ZERO_VECTOR
        return _Moved(
            position(motion, marker),
            axes(motion, marker),
            (velocity(motion, marker), apply(of_body, turning)),
            (acceleration(motion, marker, bodies), apply(of_body, growing)),
        )

    def velocity_in(self, axes: Axes) -> list[S]:
        """Return the linear and angular velocity (6)."""
        v, w = self.velocity
        if axes == "world":
            v = subtract(v, cross(w, self.position))
        return self._in(axes, v, w)

    def acceleration_in(self, axes: Axes) -> list[S]:
        """Return the rate (6) of the components of the velocity."""
        (v, w), (a, alpha) = self.velocity, self.acceleration
        if axes == "world":
            a = subtract(subtract(a, cross(alpha, self.position)), cross(w, v))
        elif axes == "local":
            a = subtract(a, cross(w, v))
        return self._in(axes, a, alpha)

    def _in(self, axes: Axes, linear: Vec, angular: Vec) -> list[S]:
        if axes == "local":
            linear, angular = (apply_transposed(self.rotation, x) for x in (linear, angular))
        return [*linear, *angular]


# ----------------------------------------------------------------------------------------------------------------------
# Programs of a tree besides its motion: the mass matrix, inverse and hybrid dynamics, Hamilton's equations.
#
# Inputs are t, q, u, parameters, inputs, modes as of every system Program; where accelerations are given, udot follows.


OF_MOMENTA: Final = "canonical equations are those of coordinates and momenta alone; choose the method multipliers"
"""Why canonical equations take no declared states."""


def mass_matrix_program(mechanism: Mechanism) -> Program:
    """Return -> mass_matrix (nu, nu) of the tree, whatever its rows."""
    trace = Trace("mass_matrix", arrays(mechanism))
    matrix = mass_matrix(economical_motion(mechanism, slot_state(mechanism)))
    return trace.finish({"mass_matrix": _matrix(matrix, len(matrix))})


def _needed_forces(motion: Motion, udot: Sequence[S]) -> list[S]:
    """Return M udot + c - Q (nu)."""
    loads = applied_forces(motion, weight=False)
    carried = carried_wrenches(motion, needed_wrenches(motion, udot, loads.of_body))
    return [x - drive for x, drive in zip(joint_projection(motion, carried), loads.of_speed, strict=True)]


def driven_dynamics_program(mechanism: Mechanism, drives: Collection[str]) -> Program:
    """Return (.., udot) -> forces (nu): those of the joints named `drives`, zero elsewhere, of least norm.

    With the rows' forces C^T lambda, of which some define others by D lambda = gamma - H udot,

        M udot + c - Q = S^T S mu + C^T lambda,   C mu + D^T eta = 0,   D lambda = d

    are the conditions of the least S mu, the forces of the drives that S picks. They are unique however many rows
    depend on each other. Accelerations are taken as given: they should satisfy H udot = gamma.
    """
    count, driven = len(mechanism.speeds), driven_speeds(mechanism, drives)
    trace = _with_udot("inverse_dynamics", mechanism)
    motion, udot = motion_of(mechanism, slot_state(mechanism)), trace["udot"]
    every = row_motions(motion)
    rows = [every[k] for k in acting_rows(every)]
    defining = [row for row in rows if not row.kinematic]
    coupling = [[as_node(row.coupling.get(k, ZERO)) for k in acting_rows(every)] for row in defining]
    wanted = [row.gamma - sum((h * a for h, a in zip(row.jacobian, udot, strict=True)), ZERO) for row in defining]
    needed = [as_node(x) for x in _needed_forces(motion, udot)]
    exerts = [list(map(as_node, row.forces)) for row in rows]
    beside = {k: tuple(map(acting_rows(every).index, row.beside)) for k, row in enumerate(rows) if row.beside}
    most = mechanism.parameters.slot(INDEPENDENT) + (count + len(defining)) if rows else real(count)

    def solve(forces: Sequence[Sequence[Node]]) -> list[Node]:
        matrix = [
            [*(ONE if i == k and k in driven else ZERO for i in range(count)), *(f[k] for f in forces)]
            + [ZERO] * len(defining)
            for k in range(count)
        ]
        columns = zip(*coupling, strict=True) if defining else ([] for _ in rows)
        matrix += [[*f, *[ZERO] * len(rows), *d] for f, d in zip(forces, columns, strict=True)]
        matrix += [[*[ZERO] * count, *d, *[ZERO] * len(defining)] for d in coupling]
        right = [*needed, *[ZERO] * len(rows), *wanted]
        return list(trace.solve(matrix, right, len(right), most).solution)

    found = solve([[ZERO] * count if k in beside else row for k, row in enumerate(exerts)] if beside else exerts)
    for _ in range(PASSES if beside else 0):
        found = solve(along_reactions(exerts, beside, found[count : count + len(rows)]))
    return trace.finish({"forces": column(found[k] if k in driven else ZERO for k in range(count))})


def driven_speeds(mechanism: Mechanism, drives: Collection[str]) -> list[int]:
    """Return the speeds of the joints named `drives`. Raises InputError for a joint without speeds."""
    speeds = {body.joint_name: body.u for body in mechanism.bodies if body.u}
    for name in drives:
        if name not in speeds:
            message = f"no joint {name!r} has a speed that a drive could move"
            raise InputError(message, number="M106", word=name, known=speeds)
    return [k for name in drives for k in speeds[name]]


def verify_drives(mechanism: Mechanism, state: State, drives: Collection[str]) -> bool:
    """Return whether more joints are driven than the freedoms of a state over floats need.

    Raises NoSolutionError where a speed is left that no drive moves.
    """
    driven, count = driven_speeds(mechanism, drives), len(mechanism.speeds)
    rows = [row.jacobian for row in row_motions(motion_of(mechanism, state)) if row.kinematic]
    restricted = rank(np.array(rows, dtype=float).reshape(len(rows), count), ROUNDED)
    both = np.array([*rows, *np.eye(count)[driven]], dtype=float).reshape(len(rows) + len(driven), count)
    left = null_space(both, ROUNDED)
    if left.size:
        sizes = np.abs(left).max(axis=1)
        free = mechanism.speeds[int(np.argmax(sizes > ROUNDED * sizes.max()))]  # others, such as mimics, follow it
        raise NoSolutionError(
            f"{count - restricted} degrees of freedom need as many drives, and with {', '.join(drives) or 'none'} the "
            f"speed {free.name} is free at the start: name joint {free.joint!r} among drives, too",
            number="N102",
        )
    return len(driven) > count - restricted


def hybrid_dynamics_program(mechanism: Mechanism, given: Collection[str]) -> Program:
    """Return (.., udot) -> udot (nu), forces (nu); `given` names the joints whose udot is read.

    Raises ModelError where rows restrict the tree, NoSolutionError where a free joint moves nothing that has mass.
    """
    _verify_tree(mechanism)
    bodies = [k for k, body in enumerate(mechanism.bodies) if body.joint_name in given]
    held = {k for index in bodies for k in mechanism.bodies[index].u}
    massless = [mechanism.speeds[k] for k in massless_speeds(mechanism) if k not in held]
    if massless:
        raise NoSolutionError(
            f"joint {massless[0].joint!r} moves nothing that has mass; give its acceleration, or the body a mass",
            number="N102",
        )
    trace = _with_udot("hybrid_dynamics", mechanism)
    udot, forces = hybrid_dynamics(motion_of(mechanism, slot_state(mechanism)), bodies, trace["udot"])
    return trace.finish({"udot": column(udot), "forces": column(forces)})


def _verify_tree(mechanism: Mechanism, advice: str = "") -> None:
    if mechanism.rows:
        section, name = mechanism.row_path(0)
        what = f"joint {name!r} closes a loop," if section == "joints" else f"{name!r} restricts the joints,"
        with at(section, name):
            raise ModelError(
                f"{what} and its force shares in the work: given accelerations determine the forces of joints only "
                f"where nothing else holds them; {advice}leave it out (load_urdf(..., mimic=False) leaves out the "
                "couplers of joints that mimic others), or put its force in as a force",
                number="M110",
            )


# ----------------------------------------------------------------------------------------------------------------------
# Programs of Hamilton's equations: p from u, u from p, the rates of q and p, and H; linear in the number of bodies.
#
#     p = dT/du (bodies' momenta, inward)      u = M^-1 (p - b) (articulated bodies)      q' = N u
#     p' = N^T dT/dq - (terms of quasi-velocities) + Q + H^T lambda, dT/dq by one reverse pass at constant u
#     H = p . u - T + V
#
# M is never formed. Q holds all loads and the weight; the multipliers are those of the accelerations at this state.


def canonical_programs(mechanism: Mechanism) -> dict[str, Program]:
    """Return the Programs `inputs`, `momenta` (of u), `speeds`, `canonical` and `hamiltonian` (of p) of a mechanism.

    Those of p have the array `momenta` where others have `u`. Raises ModelError where masses vary or something rubs,
    NoSolutionError where a freedom moves nothing with mass.
    """
    equations = _Canonical.of(mechanism)
    return {"inputs": inputs_program(mechanism), **{name: make(equations) for name, make in _PROGRAMS.items()}}


def canonical_program(mechanism: Mechanism, name: str) -> Program:
    """Return one of `canonical_programs`. Raises as that does."""
    return _PROGRAMS[name](_Canonical.of(mechanism))


def with_inputs_of_momenta(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose inputs are declared by momenta in place of speeds."""
    if not any(leaf.data[0] == "u" for leaf in leaves(mechanism.inputs.values(), "slot")):
        return mechanism
    values = _Canonical.of(mechanism)._at_momenta(list(mechanism.inputs.values()))
    return replace(mechanism, inputs=dict(zip(mechanism.inputs, values, strict=True)))


def verify_canonical(mechanism: Mechanism) -> None:
    """Raise ModelError where momenta do not determine the motion: states, masses that vary, and rows with friction."""
    verify_without_states(mechanism, OF_MOMENTA)
    for body in mechanism.bodies:
        if varies(body):
            raise ModelError(f"the mass of {body.name!r} varies, so that its momentum changes with it", number="M120")
    rows = row_motions(motion_of(mechanism, slot_state(mechanism))) if mechanism.rows else []
    for row, moved in zip(mechanism.rows, rows, strict=True):
        if moved.exerts is not None or not moved.kinematic:
            raise ModelError(
                f"{row.name!r} rubs or slides: its forces follow from reactions and are no part of canonical equations",
                number="M120",
            )
    verify_massive(mechanism, "Hamilton's equations")


@dataclass(frozen=True)
class _Canonical:
    """The motion over Nodes in slots, p(q, u), and u(q, p) with p as the slots `momenta`."""

    mechanism: Mechanism
    motion: Motion
    of_speeds: list[Node]
    speeds: list[Node]

    @classmethod
    def of(cls, mechanism: Mechanism) -> _Canonical:
        verify_canonical(mechanism)
        motion = economical_motion(mechanism, slot_state(mechanism))
        momenta = [as_node(p) for p in generalized_momenta(motion)]
        at_rest = {slot("u", k): ZERO for k in range(len(momenta))}
        bias = evaluate(momenta, lambda leaf: at_rest.get(leaf, leaf))
        free = [slot(MOMENTA, k) - b for k, b in enumerate(bias)]
        return cls(mechanism, motion, momenta, [as_node(u) for u in tree_factors(motion).solve(free)])

    def momenta_program(self) -> Program:
        """Return (.., u, ..) -> p (nu)."""
        return Trace("momenta", arrays(self.mechanism)).finish({"p": column(self.of_speeds)})

    def speeds_program(self) -> Program:
        """Return (.., momenta, ..) -> u (nu)."""
        return Trace("speeds", self._arrays()).finish({"u": column(self.speeds)})

    def function_program(self) -> Program:
        """Return (.., momenta, ..) -> H."""
        p = [slot(MOMENTA, k) for k in range(len(self.speeds))]
        along = sum((a * b for a, b in zip(p, self.speeds, strict=True)), ZERO)
        energies = [as_node(kinetic_energy(self.motion)), as_node(potential_energy(self.motion))]
        kinetic, potential = self._at_momenta(energies)
        return Trace("hamiltonian", self._arrays()).finish({"H": ((), [along - kinetic + potential])})

    def rates_program(self) -> Program:
        """Return (.., momenta, ..) -> qdot (nq), pdot (nu), multipliers (ns)."""
        trace = Trace("canonical", self._arrays())
        rates = self._at_momenta(self._forces())
        multipliers: Sequence[Node] = ()
        if self.mechanism.rows:
            dynamics = block_ldl(self.mechanism, self._state())
            _, multipliers, _ = constrained_motion(trace, self.mechanism, dynamics)
            for row, multiplier in zip(dynamics.rows, multipliers, strict=True):
                rates = [rate + as_node(h) * multiplier for rate, h in zip(rates, row.jacobian, strict=True)]
        qdot = coordinate_rates(self.mechanism, self.motion.state.q, self.speeds)
        return trace.finish({"qdot": column(qdot), "pdot": column(rates), "multipliers": column(multipliers)})

    def _forces(self) -> list[Node]:
        """Return p' without rows, in slots of q and u."""
        q, u = self.motion.state.q, self.motion.state.u
        slopes = gradient(as_node(kinetic_energy(self.motion)), q)
        found = [as_node(x) for x in applied_generalized_forces(self.motion, applied_forces(self.motion))]
        for body in self.mechanism.bodies:
            for k in body.u:
                column = joint_rates(body, q, [int(j == k) for j in range(len(u))])
                found[k] = found[k] + sum(n * slopes[i] for n, i in zip(column, body.q, strict=True))
            for free in body.free_steps:
                turned = turning_momenta(free.step, [u[k] for k in free.u], [self.of_speeds[k] for k in free.u])
                for k, x in zip(free.u, turned, strict=True):
                    found[k] = found[k] - x
        return found

    def _at_momenta(self, nodes: Sequence[Node]) -> list[Node]:
        """Return Nodes in q and u as ones in q and p."""
        known: Mapping[Node, Node] = {slot("u", k): u for k, u in enumerate(self.speeds)}
        return [as_node(x) for x in evaluate(nodes, lambda leaf: known.get(leaf, leaf))]

    def _state(self) -> State:
        state = slot_state(self.mechanism)
        counted = (("parameters", len(self.mechanism.parameters)), ("inputs", len(self.mechanism.inputs)))
        parameters, inputs = ([slot(array, k) for k in range(n)] for array, n in counted)
        return state_of(self.mechanism, Node, slot("t", 0), state.q, self.speeds, parameters, inputs)

    def _arrays(self) -> tuple[Array, ...]:
        renamed = {"u": Array(MOMENTA, (len(self.speeds),))}
        return tuple(renamed.get(array.name, array) for array in arrays(self.mechanism))


_PROGRAMS: Final[Mapping[str, Callable[[_Canonical], Program]]] = {
    "momenta": _Canonical.momenta_program,
    "speeds": _Canonical.speeds_program,
    "canonical": _Canonical.rates_program,
    "hamiltonian": _Canonical.function_program,
}


# ----------------------------------------------------------------------------------------------------------------------

Name = Literal[
    "state_derivative",
    "mass_matrix",
    "inverse_dynamics",
    "hybrid_dynamics",
    "bias",
    "gravity",
    "energies",
    "momentum",
    "centroidal_momentum",
    "constraints",
    "reactions",
    "coriolis_matrix",
    "regressor",
    "outputs",
    "frame",
    "acceleration",
    "jacobian",
    "operational_space",
    "generalized_momenta",
    "canonical_equations",
    "hamiltonian",
    "impact",
]
IMPACT: Final = "impact"
"""The function of what a mode of an impact does (`dynamics/contact/impact_programs.py`)."""
STATE_FUNCTIONS: Final[Mapping[str, StateFunction]] = {
    "state_derivative": _state_derivative,
    "mass_matrix": lambda mechanism, _: mass_matrix_program(mechanism),
    "inverse_dynamics": _inverse_dynamics,
    "hybrid_dynamics": lambda mechanism, options: hybrid_dynamics_program(mechanism, options.given),
    "bias": _at_state("bias", _bias),
    "gravity": _at_state("gravity", lambda motion, _: {"gravity": column(_weight(motion))}),
    "energies": lambda mechanism, _: energy_program(mechanism),
    "momentum": _at_state("momentum", _momentum),
    "centroidal_momentum": _at_state("centroidal_momentum", _centroidal_momentum),
    "constraints": _at_state("constraints", _constraints),
    "reactions": _reactions,
    "coriolis_matrix": _coriolis_matrix,
    "regressor": _regressor,
    "outputs": outputs_of_function,
    "frame": _at_state("frame", _frame),
    "acceleration": _acceleration,
    "jacobian": _jacobian,
    "operational_space": _operational_space,
    "generalized_momenta": lambda mechanism, _: canonical_program(mechanism, "momenta"),
    "canonical_equations": lambda mechanism, _: canonical_program(mechanism, "canonical"),
    "hamiltonian": lambda mechanism, _: canonical_program(mechanism, "hamiltonian"),
}
OPTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "hybrid_dynamics": ("given",),
    "inverse_dynamics": ("drives", "mode"),
    **dict.fromkeys(
        ("state_derivative", "canonical_equations", "constraints", "reactions", "outputs", IMPACT), ("mode",)
    ),
    **dict.fromkeys(("frame", "acceleration", "jacobian", "operational_space"), ("frame", "axes")),
}
"""The options that a function has; others have none."""


def with_declared_inputs(mechanism: Mechanism, program: Program) -> Program:
    """Return the Program in which inputs have their declared expressions, whatever the array `inputs` holds."""
    if not mechanism.inputs:
        return program
    trace = Trace(program.name, program.inputs)
    inputs = inputs_program(mechanism, program.inputs)
    (values,) = trace.call(inputs, [trace[array.name] for array in inputs.inputs])
    given = [values if array.name == "inputs" else trace[array.name] for array in program.inputs]
    found = zip(program.outputs, trace.call(program, given), strict=True)
    return trace.finish({output.name: (output.shape, list(map(callee_value, x, output.values))) for output, x in found})
