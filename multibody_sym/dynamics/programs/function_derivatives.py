"""Derivatives of functions of the state, as Programs: of accelerations and forces along the tree, of others forward.

Column k of a derivative by q is the rate of the function while speed k alone is one: q moves along the tangent of the
configuration, a quaternion on its sphere.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from string import ascii_lowercase
from typing import Final, Literal, get_args

from multibody_sym.dynamics.formalisms.composite_body import mass_matrix, needed_wrenches, summed_inward
from multibody_sym.dynamics.formalisms.equations import BodyAxes, along_body_axes, coupled_groups
from multibody_sym.dynamics.formalisms.inertia import RigidInertia, base_inertias
from multibody_sym.dynamics.programs.quantities import MOMENTA, column
from multibody_sym.dynamics.start.parameters import evaluation_order
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.forces import applied_forces, varies
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.motion import (
    BodyMotion,
    Motion,
    accelerations,
    arrays,
    body_motion,
    coordinate_rates,
    joint_rates,
    moving_parent,
    qdot_of,
    slot_state,
    spread,
)
from multibody_sym.mechanics.points import (
    NO_WRENCH,
    Wrench,
    carried_wrenches,
    generalized_forces,
    joint_projection,
    power,
    to_parent,
)
from multibody_sym.program.derivatives import Direction, callee_value, jacobian_along, resume_trace, traced_rates
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array, Kernel, Loop, Progression, Window
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import gradient, tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Factors,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    combination,
    cross,
    dot,
    factorize,
    matrix_sum,
    negate,
    scale,
    subtract,
    turned_tensor,
)

Variable = Literal["t", "q", "u", "p", "s", "udot", "inputs", "parameters"]
"""By what a function is differentiated; by q along the tangent, by s along the declared states, the last of q."""
VARIABLES: Final[tuple[Variable, ...]] = get_args(Variable)
Columns = list[list[Node]]
_LANES: Final = 4
"""Columns that a vector register holds: of floats in 256 bits."""
Elements = tuple[tuple[int, ...], Sequence[Node]]
"""The shape of a result and its elements, row by row."""


@dataclass(frozen=True)
class Derivatives:
    """The `values` of a function by name and their `slopes` by name and variable, as `trace` computes them."""

    trace: Trace
    values: dict[str, Elements]
    slopes: dict[tuple[str, Variable], Elements] = field(default_factory=dict)

    def add(self, name: str, by: Variable, columns: Sequence[Sequence[Node]]) -> None:
        """Take over the columns of the derivative of a value."""
        (shape, values), width = self.values[name], len(columns)
        self.slopes[name, by] = (*shape, width), [column[row] for row in range(len(values)) for column in columns]

    def alone(self) -> Program:
        """Return the Program of the derivatives, which have the names of the values: columns by variable, in a row."""
        found = {}
        for name, (shape, values) in self.values.items():
            blocks = [(each[0][-1], each[1]) for (own, _), each in self.slopes.items() if own == name]
            rows = [x for row in range(len(values)) for n, block in blocks for x in block[n * row : n * row + n]]
            found[name] = (*shape, sum(n for n, _ in blocks)), rows
        return self.trace.finish(found)

    def with_values(self, names: Sequence[str]) -> Program:
        """Return the Program of some values, and of their derivatives as NAME_by_VARIABLE."""
        found = {name: self.values[name] for name in names}
        found |= {f"{name}_by_{by}": slope for (name, by), slope in self.slopes.items() if name in names}
        return self.trace.finish(found)


def differentiated(
    mechanism: Mechanism, program: Program, variables: Sequence[Variable], *, declared: Collection[str]
) -> Derivatives:
    """Return the derivatives of all outputs of a Program: one axis more, the last.

    By "q" along the tangent (nu), by "parameters" by those that follow from no others, which the others follow. Inputs
    of the names `declared` move with the state as their expressions do, others stand still.
    """
    ways = [directions(mechanism, variable, declared=declared) for variable in variables]
    name = f"{program.name}_by_{'_'.join(variables)}"
    trace, columns = traced_rates(program, [way for each in ways for way in each], name=name)
    found = Derivatives(trace, {output.name: (output.shape, output.values) for output in program.outputs})
    first = 0
    for output in program.outputs:
        last, rest = first + len(output.values), iter(columns)
        for variable, each in zip(variables, ways, strict=True):
            found.add(output.name, variable, [next(rest)[first:last] for _ in each])
        first = last
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Along the tree, with forces and accelerations along the axes of free bodies: forces = M udot + c - Q.


def differentiated_accelerations(
    mechanism: Mechanism, whole: Program, variables: Sequence[Variable], *, declared: Collection[str]
) -> Derivatives:
    """Return the derivatives of qdot, udot and no multipliers of a tree: M d(udot) = -d(forces) at fixed udot."""
    qdot, udot, multipliers = (output.name for output in whole.outputs)
    trace = Trace(f"{whole.name}_by_{'_'.join(variables)}", whole.inputs)
    tree = _Tree.of(mechanism)
    accelerations = tree.accelerations()
    slopes, shifts = tree.forces_by(trace, accelerations, variables, declared=declared, hold=True)
    columns = iter(tree.solved(trace, [[-x for x in each] for by in variables for each in slopes[by]]))
    rates = column(qdot_of(slot_state(mechanism), mechanism))
    values: dict[str, Elements] = {qdot: rates, udot: column(tree.in_space(accelerations)), multipliers: ((0,), [])}
    of_q = Trace("qdot", whole.inputs).finish({qdot: rates})
    found = Derivatives(trace, values, differentiated(mechanism, of_q, variables, declared=declared).slopes)
    for by in variables:
        own = [next(columns) for _ in slopes[by]]
        if by == "q":
            for k, shift in shifts.items():
                own[k] = [x - as_node(y) for x, y in zip(own[k], tree.in_space(shift), strict=True)]
        found.add(udot, by, own)
        found.add(multipliers, by, [()] * len(own))
    return found


def differentiated_forces(
    mechanism: Mechanism, program: Program, variables: Sequence[Variable], *, declared: Collection[str]
) -> Derivatives:
    """Return the derivatives of inverse dynamics of a tree: by udot they are M."""
    trace = Trace(f"{program.name}_by_{'_'.join(variables)}", program.inputs)
    tree = _Tree.of(mechanism)
    udot = tree.along_axes(trace["udot"])
    slopes, _ = tree.forces_by(trace, udot, variables, declared=declared, hold=False)
    (output,) = program.outputs
    needed = tree.needed(udot)
    found = Derivatives(trace, {output.name: column(tree.in_space(needed))})
    for by in variables:
        columns = list(map(tree.in_space, slopes[by]))
        for axes in tree.along if by == "q" else ():  # the axes turn with the body
            force = [needed[k] for k in axes.speeds]
            for k in mechanism.bodies[axes.body].u:
                turned = apply(axes.directions, cross(tree.angular(axes.body, k), force))
                for row, x in zip(axes.speeds, turned, strict=True):
                    columns[k][row] = columns[k][row] + x
        found.add(output.name, by, [list(map(as_node, each)) for each in columns])
    return found


def derived(
    mechanism: Mechanism,
    name: str,
    program: Program,
    by: Sequence[Variable],
    of: Sequence[str] = (),
    declared: Collection[str] = (),
) -> Program:
    """Return the Program of the function of this name differentiated: alone, or with its values `of` these names.

    Inputs of the names `declared` follow the state.
    """
    along_tree = {"state_derivative": differentiated_accelerations, "inverse_dynamics": differentiated_forces}
    derive = differentiated if mechanism.rows else along_tree.get(name, differentiated)
    found = derive(mechanism, program, by, declared=declared)
    return found.with_values(of) if of else found.alone()


@dataclass(frozen=True)
class _Tree:
    """A tree in slots, its free bodies `along` their axes."""

    motion: Motion
    along: tuple[BodyAxes, ...]

    @staticmethod
    def of(mechanism: Mechanism) -> _Tree:
        return _Tree(*along_body_axes(economical_motion(mechanism, slot_state(mechanism))))

    @property
    def mechanism(self) -> Mechanism:
        return self.motion.mechanism

    def angular(self, body: int, speed: int) -> Vec:
        """Return the partial angular velocity of a body for a speed of its joint."""
        return self.motion.bodies[body].angular[self.mechanism.bodies[body].u.index(speed)]

    def in_space(self, x: Sequence[S]) -> list[S]:
        """Return T x: what is along axes of free bodies along those of their parents."""
        for axes in self.along:
            x = axes.rates(x)
        return list(x)

    def along_axes(self, x: Sequence[S]) -> list[S]:
        """Return T^T x."""
        for axes in self.along:
            x = axes.forces(x)
        return list(x)

    def needed(self, udot: Sequence[S]) -> list[S]:
        """Return M udot + c - Q (n)."""
        of_body, of_speed = self._loads
        carried = carried_wrenches(self.motion, needed_wrenches(self.motion, udot, of_body))
        return [x - q for x, q in zip(joint_projection(self.motion, carried), of_speed, strict=True)]

    def accelerations(self) -> list[Node]:
        """Return udot (n)."""
        right = [-x for x in self.needed([0] * len(self.mechanism.speeds))]
        return [as_node(x) for x in self._factors.to_left(self._divided(self._factors.from_right(right)))]

    @cached_property
    def _loads(self) -> tuple[list[Wrench], list[S]]:
        loads = applied_forces(self.motion, weight=False)
        return loads.of_body, self.along_axes(loads.of_speed)

    @cached_property
    def _factors(self) -> Factors:
        return factorize(mass_matrix(self.motion))

    @cached_property
    def _inverse_pivots(self) -> list[Node]:
        return [1 / as_node(d) for d in self._factors.pivots]

    def _divided(self, x: Sequence[S]) -> list[S]:
        return [a * b for a, b in zip(x, self._inverse_pivots, strict=True)]

    # --- slopes of forces ---------------------------------------------------------------------------------------------

    def forces_by(
        self, trace: Trace, udot: list[S], variables: Sequence[Variable], *, declared: Collection[str], hold: bool
    ) -> tuple[dict[Variable, Columns], dict[int, list[S]]]:
        """Return the derivatives of M udot + c - Q (n, along the axes of free bodies, as udot), at fixed T udot.

        They have one column a direction; with `hold` the shifts of udot beside those by q follow.
        By q and u along the tree, loads forward; where masses change with the state, and by all others, forward.
        """
        columns, shifts, count = dict[Variable, Columns](), dict[int, list[S]](), len(udot)
        tree = not any(map(varies, self.mechanism.bodies))
        found = _Sweep(self.motion, udot, {axes.body for axes in self.along}, hold).slopes() if tree else None
        for by in variables:
            of_tree = found is not None and by in ("q", "u")
            program = self._loads_program() if of_tree else self._needed_program()
            ways = directions(self.mechanism, by, declared=declared)
            forward = jacobian_along(program, ways, name=f"{program.name}_by_{by}")
            given = [self.in_space(udot) if array.name == "udot" else trace[array.name] for array in program.inputs]
            (values,) = trace.call(forward, given)
            values = tuple(map(callee_value, values, forward.outputs[0].values))
            columns[by] = [list(values[k :: len(ways)]) for k in range(len(ways))]
            if found is not None and of_tree:
                matrix = found.by_q if by == "q" else found.by_u
                columns[by] = [[matrix[i][k] - x for i, x in enumerate(each)] for k, each in enumerate(columns[by])]
        if found is not None and hold:
            for k, shift in found.shifts.items():
                (axes,) = (axes for axes in self.along if k in self.mechanism.bodies[axes.body].u)
                shifts[k] = [0] * count
                for i, x in zip(axes.speeds, shift, strict=True):
                    shifts[k][i] = x
        return columns, shifts

    def _loads_program(self) -> Program:
        of_body, of_speed = self._loads
        forces = [a + b for a, b in zip(generalized_forces(self.motion, of_body), of_speed, strict=True)]
        return Trace("loads", arrays(self.mechanism)).finish({"forces": column(forces)})

    def _needed_program(self) -> Program:
        """Return (.., udot) -> M udot + c - Q (n, along the axes of free bodies)."""
        trace = Trace("needed_forces", (*arrays(self.mechanism), Array("udot", (len(self.mechanism.speeds),))))
        return trace.finish({"forces": column(self.needed(self.along_axes(trace["udot"])))})

    # --- accelerations from forces ------------------------------------------------------------------------------------

    def solved(self, trace: Trace, columns: Columns) -> Columns:
        """Return T M^-1 of each column, by loops over columns that compilers vectorise.

        A loop has the columns of one branch, which needs no elimination of the others, or those that concern several.
        """
        found = [[ZERO] * len(self.mechanism.speeds) for _ in columns]
        for places, branches in self._groups:
            together: dict[tuple[int, ...], list[int]] = {}
            for k, each in enumerate(columns):
                if moving := {i for i in places if each[i] is not ZERO}:
                    branch = next((branch for branch in branches if moving <= {*branch}), places)
                    together.setdefault(branch, []).append(k)
            for branch, members in self._joined(places, together).items():
                idle = [ZERO] * (-len(members) % _LANES)  # which cost less than columns one by one
                right = {i: [*(columns[k][i] for k in members), *idle] for i in branch}
                for i, row in zip(places, self._solved_together(trace, places, right), strict=True):
                    for k, x in zip(members, row, strict=False):
                        found[k][i] = x
        return found

    def _joined(
        self, places: tuple[int, ...], together: dict[tuple[int, ...], list[int]]
    ) -> dict[tuple[int, ...], list[int]]:
        """Return columns by branch, those of a small branch in a larger one where that takes less turns of registers.

        A turn takes the factors of a branch twice, forward and back, and those of speeds beyond it once.
        """
        found = dict(sorted(together.items(), key=lambda item: len(item[0])))
        terms = {
            branch: sum(map(len, self._below(places, branch))) + sum(len(self._factors.below[k]) for k in branch)
            for branch in found
        }

        def turns(columns: list[int], branch: tuple[int, ...]) -> int:
            return math.ceil(len(columns) / _LANES) * terms[branch]

        for small in list(found)[:-1]:
            gains = {
                large: turns(found[small], small) + turns(others, large) - turns([*found[small], *others], large)
                for large, others in found.items()
                if large != small and {*small} <= {*large}
            }
            best = max(gains, key=gains.__getitem__, default=small)
            if gains.get(best, 0) > 0:
                found[best] = found[best] + found.pop(small)
        return found

    @cached_property
    def _groups(self) -> list[tuple[tuple[int, ...], list[tuple[int, ...]]]]:
        """Groups of speeds that the mass matrix couples, the smallest first, each with its branches.

        A branch is a speed with the speeds that carry it and the speeds that it carries.
        """
        carrying = [{k, *(i for i, _ in row)} for k, row in enumerate(self._factors.below)]
        branches = [carrying[k] | {m for m, row in enumerate(carrying) if k in row} for k in range(len(carrying))]
        groups = coupled_groups([*carrying, *(set(axes.speeds) for axes in self.along)])
        return [(tuple(sorted(x)), sorted({tuple(sorted(branches[k])) for k in x}, key=len)) for x in groups]

    def _solved_together(
        self, trace: Trace, places: tuple[int, ...], right: Mapping[int, list[Node]]
    ) -> list[tuple[Node, ...]]:
        """Return the rows of T M^-1 at these places for some rows of right sides."""
        along = [axes for axes in self.along if axes.speeds[0] in places]
        below = self._below(places, right)
        factors = [factor for row in below for _, factor in row]
        factors += [self._inverse_pivots[k] for k in places]
        factors += [x for axes in along for row in axes.directions for x in row]
        live = [k for k, row in right.items() if any(x is not ZERO for x in row)]
        kernel = self._kernel(places, [[i for i, _ in row] for row in below], live, len(factors), along)
        width, begin = len(right[live[0]]), Progression((0,))
        reads = [Window(0, begin), *(Window(1, Progression((k * width,), 1)) for k in range(len(live)))]
        writes = [Window(2, Progression((k * width,), 1)) for k in range(len(places))]
        loop = Loop(width, (Kernel(kernel, tuple(reads), tuple(writes)),))
        given = [list(map(as_node, factors)), [x for k in live for x in right[k]]]
        (found,) = trace.scan(given, [len(places) * width], [], [loop])
        return [found[k * width : (k + 1) * width] for k in range(len(places))]

    def _below(self, places: tuple[int, ...], branch: Collection[int]) -> list[list[tuple[int, Node]]]:
        """Return the factors of each place by those that it takes part of, for forces on one branch.

        Speeds beyond the branch follow from those of the branch that carry them alone: nothing else moves them.
        """
        found: dict[int, list[tuple[int, Node]]] = {}
        for k in places:
            row = {i: as_node(x) for i, x in self._factors.below[k]}
            for m in [i for i in row if i not in branch and k not in branch]:
                factor = row.pop(m)
                for i, x in found[m]:
                    row[i] = row.get(i, ZERO) - factor * x
            found[k] = list(row.items())
        return [found[k] for k in places]

    def _kernel(
        self,
        places: tuple[int, ...],
        carrying: Sequence[Sequence[int]],
        live: Sequence[int],
        size: int,
        along: Sequence[BodyAxes],
    ) -> Program:
        """Return (factors, of each live row its force) -> acceleration of each place, `carrying` those of each."""
        trace = Trace("accelerations", [Array("factors", (size,)), *(Array(_letters("force", k)) for k in live)])
        rest = iter(trace["factors"])
        index = {k: place for place, k in enumerate(places)}
        below = tuple(tuple((index[i], next(rest)) for i in row) for row in carrying)
        inverse = [next(rest) for _ in places]
        factors = Factors(below, tuple(inverse))
        right = [trace[_letters("force", k)][0] if k in live else ZERO for k in places]
        x: Sequence[S] = factors.to_left([a * b for a, b in zip(factors.from_right(right), inverse, strict=True)])
        for axes in along:
            a, b, c = ((next(rest), next(rest), next(rest)) for _ in range(3))
            x = replace(axes, speeds=tuple(index[k] for k in axes.speeds), directions=(a, b, c)).rates(x)
        return trace.finish({_letters("rate", k): ((), [as_node(value)]) for k, value in enumerate(x)})


def _letters(name: str, number: int) -> str:
    high, low = divmod(number, len(ascii_lowercase))
    return (_letters(name, high - 1) if high else f"{name}_") + ascii_lowercase[low]


# ----------------------------------------------------------------------------------------------------------------------
# Directions in which a state moves.


def state_jacobian(
    mechanism: Mechanism,
    whole: Program,
    *,
    free: Collection[str] = (),
    count: int = 2,
    name: str = "state_jacobian",
) -> Program:
    """Return -> jacobian of the first `count` outputs, qdot and udot if not said otherwise, by x = (q, u).

    Behind its nq + nu columns are those by the inputs `free`, which have values of their own; other inputs are as
    declared. Quaternions have length one there.
    """
    nq, nu = len(mechanism.coordinates), len(mechanism.speeds)
    ways: list[Direction] = [*({"q": way} for way in _units(nq)), *({"u": way} for way in _units(nu))]
    ways = [_with_inputs(mechanism, way, [x for x in mechanism.inputs if x not in free]) for way in ways]
    inputs = zip(mechanism.inputs, _units(len(mechanism.inputs)), strict=True)
    ways += [{"inputs": way} for each, way in inputs if each in free]
    slopes = jacobian_along(whole, ways, name=name)
    values = [x for output in slopes.outputs[:count] for x in output.values]
    trace = resume_trace(slopes, name, ())
    return trace.finish({"jacobian": ((len(values) // max(1, len(ways)), len(ways)), values)})


def directions(mechanism: Mechanism, variable: Variable, *, declared: Collection[str] = ()) -> list[Direction]:
    """Return the directions in which a variable moves: of inputs those that drive no motion, whose rates are not known.

    Inputs of the names `declared` move with the state as their expressions do, others stand still.
    """
    count = len(mechanism.speeds)
    ways: list[Direction]
    if variable == "q":
        ways = [{"q": rates_along(mechanism, way)} for way in _units(count)]
    elif variable == "parameters":
        ways = [{"parameters": way} for way in _parameter_ways(mechanism)]
    elif variable == "s":
        states = [c.rate is not None for c in mechanism.coordinates]
        ways = [{"q": way} for way, state in zip(_units(len(states)), states, strict=True) if state]
    elif variable == "inputs":
        units = zip(mechanism.inputs, _units(len(mechanism.inputs)), strict=True)
        return [{variable: way} for name, way in units if name not in mechanism.driving_inputs]
    else:
        array = MOMENTA if variable == "p" else variable
        ways = [{array: way} for way in _units(1 if variable == "t" else count)]
    return [_with_inputs(mechanism, way, declared) for way in ways] if declared else ways


def _with_inputs(mechanism: Mechanism, way: Direction, declared: Collection[str]) -> Direction:
    """Return a direction with the rates that inputs of the names `declared` have along it."""
    moving = {slot(name, k): rate for name, rates in way.items() for k, rate in enumerate(rates) if rate is not ZERO}
    found = []
    for name, expression in mechanism.inputs.items():
        on = [x for x in leaves([expression], "slot") if x in moving] if name in declared else []
        slopes = zip(on, gradient(expression, on), strict=True)
        found.append(sum((slope * moving[leaf] for leaf, slope in slopes), ZERO))
    return {**way, "inputs": tuple(found)} if found else way


def _units(size: int) -> list[tuple[Node, ...]]:
    return [tuple(ONE if i == k else ZERO for i in range(size)) for k in range(size)]


def rates_along(mechanism: Mechanism, u: Sequence[Node]) -> tuple[Node, ...]:
    """Return the rates of all coordinates at speeds."""
    return tuple(as_node(x) for x in coordinate_rates(mechanism, slot_state(mechanism).q, u))


def _parameter_ways(mechanism: Mechanism) -> list[tuple[Node, ...]]:
    """Return by how much all parameters (np) move with each that follows from no others."""
    entries, places = mechanism.parameters, [slot("parameters", k) for k in range(len(mechanism.parameters))]
    ways = []
    for k in independent_parameters(mechanism):
        moving: dict[Node, Node] = {places[k]: ONE}
        for index in evaluation_order(mechanism, {}):
            expression = entries[index].value
            if expression is None or index == k:
                continue
            if on := [x for x in leaves([expression], "slot") if x in moving]:
                slopes = zip(on, gradient(expression, on), strict=True)
                moving[places[index]] = sum((slope * moving[leaf] for leaf, slope in slopes), ZERO)
        ways.append(tuple(moving.get(place, ZERO) for place in places))
    return ways


def independent_parameters(mechanism: Mechanism) -> list[int]:
    """Return the places of the parameters that are declared by a number."""
    entries = enumerate(mechanism.parameters)
    declared = ((k, entry) for k, entry in entries if entry.source is Source.DECLARED)
    return [k for k, entry in declared if entry.value is None or not leaves([entry.value], "slot")]


# ----------------------------------------------------------------------------------------------------------------------
# How the forces that a tree needs change with its coordinates and speeds: derivatives of inverse dynamics.
#
# A subtree feels of the world only how its base moves. Where that changes by (da, dalpha, dw), with v_0 the velocity of
# the origin and w the angular velocity, each point at r accelerates more by
#
#     da + dalpha' x r + 2 dw x (v - v_0),      dalpha' = dalpha + w x dw
#
# so that the wrench on all it carries changes by what few numbers of the composite say: m, h, J, the momentum
# P = integral (v - v_0) dm and Q = integral r (v - v_0)^T dm:
#
#     m da + dalpha' x h + 2 dw x P        J dalpha' + h x da + 2 (tr Q - Q^T) dw
#
# A joint that moves on turns all that it carries by theta and shifts it by lambda: the motion changes as seen from the
# body, and the wrench that it hands to its parent turns with it. So three wrenches for each speed (for unit udot, u and
# q) go down the tree to the ground. What a joint on this path does to the force of the speed follows by reciprocity:
# the wrench for unit udot is also what the force feels of da and dalpha', and one more vector what it feels of dw.
#
# Sources: Carpentier and Mansard (2018), Analytical derivatives of rigid body dynamics algorithms; Singh, Russell and
# Wensing (2022), Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra; here with
# accelerations of points, along axes of the bodies.



Matrix = list[list[Node]]


@dataclass(frozen=True)
class ForceSlopes:
    """M (n x n), d forces/dq along the tangent and d forces/du (n x n), where forces = M udot + c with the weight.

    `shifts[k]`: of a free body whose acceleration is held while its own q_k moves on, by how much udot, along the
    body's axes, is less than where udot is held.
    """

    mass_matrix: Matrix
    by_q: Matrix
    by_u: Matrix
    shifts: dict[int, Vec] = field(default_factory=dict)


@dataclass(frozen=True)
class _Composite:
    """All that a body carries, in its axes about its origin: inertia, 2 P and 2 Q."""

    inertia: RigidInertia
    momentum: Vec
    moments: Mat

    @staticmethod
    def of(inertia: RigidInertia, w: Vec) -> _Composite:
        """Return that of one rigid body: P = w x h, and rows w x E_i of Q with E = tr(J)/2 - J."""
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.inertia
        half, twice = (xx + yy + zz) / 2, scale(2, w)
        rows: Mat = (half - xx, -xy, -xz), (-xy, half - yy, -yz), (-xz, -yz, half - zz)
        return _Composite(inertia, cross(twice, inertia.moment), _rows([cross(twice, row) for row in rows]))

    def plus(self, other: _Composite) -> _Composite:
        momentum, moments = add(self.momentum, other.momentum), matrix_sum(self.moments, other.moments)
        return _Composite(self.inertia.plus(other.inertia), momentum, moments)

    def moved(self, moved: BodyMotion, twice_v: Vec) -> _Composite:
        """Return the same in the parent's axes about its origin, from which this one moves away at v."""
        R, p = moved.R_PB, moved.p_PB
        momentum = add(apply(R, self.momentum), scale(self.inertia.mass, twice_v))
        h = apply(R, self.inertia.moment)
        shift = _rows([add(scale(x, momentum), scale(y, twice_v)) for x, y in zip(p, h, strict=True)])
        return _Composite(self.inertia.moved(R, p), momentum, matrix_sum(turned_tensor(R, self.moments), shift))

    def needed(self, change: _Change) -> Wrench:
        """Return the wrench that a change of the base's motion needs."""
        force, moment = self.inertia.wrench(change.a, change.alpha)
        turning = subtract(scale(self._trace, change.w), apply_transposed(self.moments, change.w))
        return add(force, cross(change.w, self.momentum)), add(moment, turning)

    def felt(self, linear: Vec, angular: Vec) -> Vec:
        """Return what the force along a partial velocity feels of dw."""
        turning = subtract(scale(self._trace, angular), apply(self.moments, angular))
        return add(turning, cross(self.momentum, linear))

    @property
    def _trace(self) -> S:
        return self.moments[0][0] + self.moments[1][1] + self.moments[2][2]


def _rows(rows: Sequence[Vec]) -> Mat:
    x, y, z = rows
    return x, y, z


@dataclass(frozen=True)
class _Change:
    """How the motion of a body changes, seen along its axes: da, dalpha + w x dw, dw."""

    a: Vec
    alpha: Vec
    w: Vec

    def felt_by(self, wrench: Wrench, turning: Vec) -> Node:
        return as_node(power(self.a, self.alpha, wrench) + dot(self.w, turning))


_STILL: Final = moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR)


@dataclass(frozen=True)
class _Freedom:
    """A speed k of a body: its partial velocities, how the body's motion changes with q_k and u_k, and how the partial
    velocities of all speeds of the body change with q_k."""

    speed: int
    linear: Vec
    angular: Vec
    of_q: _Change
    of_u: _Change
    partials: tuple[tuple[Vec, Vec], ...]

    def force(self, wrench: Wrench) -> Node:
        """Return the generalised force of a wrench."""
        return as_node(power(self.linear, self.angular, wrench))


class _Sweep:
    """The tree at a state: `reached` accelerations, the `total` wrenches that joints hand on, and composites.

    `motion` and the `free` bodies as `along_body_axes` returns them: forces and udot are along the axes of free bodies.
    With `hold` the accelerations of their origins are held, not udot: what is carried then feels nothing where they
    turn. Loads count as constant.
    """

    def __init__(self, motion: Motion, udot: Sequence[S], free: Collection[int], hold: bool) -> None:
        self.motion, self.udot, self.free, self.hold = motion, udot, free, hold
        self.reached = accelerations(motion, udot, negate(motion.gravity))
        self.total = carried_wrenches(motion, needed_wrenches(motion, udot, [NO_WRENCH] * len(motion.bodies)))
        self.shifts: dict[int, Vec] = {}
        self.joints = [_Joint.of(motion, index, udot, index in free) for index in range(len(motion.bodies))]
        self.freedoms = [self._freedoms(index) for index in range(len(motion.bodies))]

    def slopes(self) -> ForceSlopes:
        """Return M and the derivatives."""
        count = len(self.udot)
        M, by_q, by_u = ([[ZERO] * count for _ in range(count)] for _ in range(3))
        found = ForceSlopes(M, by_q, by_u, self.shifts)
        for index, freedoms in enumerate(self.freedoms):
            for freedom in freedoms:
                self._towards_ground(found, index, freedom)
        return found

    def _towards_ground(self, found: ForceSlopes, index: int, k: _Freedom) -> None:
        """Enter what a freedom of a body has to do with those of the body and of all that carry it."""
        M, by_q, by_u, bodies = found.mass_matrix, found.by_q, found.by_u, self.motion.mechanism.bodies
        composite, total = self.composites[index], self.total[index]
        of_udot = composite.inertia.wrench(k.linear, k.angular)
        of_u, of_q = composite.needed(k.of_u), composite.needed(k.of_q)
        for j, partial in zip(self.freedoms[index], k.partials, strict=True):
            M[j.speed][k.speed] = j.force(of_udot)
            by_u[j.speed][k.speed] = j.force(of_u)
            by_q[j.speed][k.speed] = j.force(of_q) + as_node(power(*partial, total))
        turned = add(of_q[0], cross(k.angular, total[0]))
        turned_moment = add(of_q[1], add(cross(k.angular, total[1]), cross(k.linear, total[0])))
        wrenches, feels = (of_udot, of_u, (turned, turned_moment)), composite.felt(k.linear, k.angular)
        while (parent := bodies[index].parent) >= 0:
            moved = self.motion.bodies[index]
            feels = add(apply(moved.R_PB, feels), cross(self.departing[index], apply(moved.R_PB, wrenches[0][0])))
            of_udot, of_u, of_q = (to_parent(moved, wrench) for wrench in wrenches)
            for j in self.freedoms[parent]:
                M[j.speed][k.speed] = M[k.speed][j.speed] = j.force(of_udot)
                by_u[j.speed][k.speed], by_q[j.speed][k.speed] = j.force(of_u), j.force(of_q)
                by_u[k.speed][j.speed] = j.of_u.felt_by(of_udot, feels)
                by_q[k.speed][j.speed] = j.of_q.felt_by(of_udot, feels)
            wrenches, index = (of_udot, of_u, of_q), parent

    @cached_property
    def composites(self) -> list[_Composite]:
        """What each body carries."""
        bodies = self.motion.bodies
        own = (_Composite.of(x, moved.w_WB) for x, moved in zip(base_inertias(self.motion), bodies, strict=True))
        return summed_inward(self.motion, own, lambda index, x: x.moved(bodies[index], self.departing[index]))

    @cached_property
    def departing(self) -> list[Vec]:
        """Twice the velocity of each body's origin from that of its parent, in the parent's axes."""
        found = []
        for body, moved, joint in zip(self.motion.mechanism.bodies, self.motion.bodies, self.joints, strict=True):
            w = self.motion.bodies[body.parent].w_WB if body.parent >= 0 else ZERO_VECTOR
            found.append(add(cross(scale(2, w), moved.p_PB), apply(moved.R_PB, scale(2, joint.v))))
        return found

    def _freedoms(self, index: int) -> list[_Freedom]:
        """Return the freedoms of a body's joint.

        With D x = dx + theta x x, the change of a vector of the joint seen from its parent, which is zero where joints
        turn about and slide along fixed axes: dw = w x theta + D w_rel, and so on.
        """
        motion, (a, alpha) = self.motion, self.reached[index]
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        w, w_parent, alpha_parent = moved.w_WB, ZERO_VECTOR, ZERO_VECTOR
        if body.parent >= 0:
            w_parent = apply_transposed(moved.R_PB, motion.bodies[body.parent].w_WB)
            alpha_parent = apply_transposed(moved.R_PB, self.reached[body.parent][1])
        joint = self.joints[index]
        found = []
        for place, k in enumerate(body.u):
            linear, angular = moved.linear[place], moved.angular[place]
            here, partials = joint.along(place, angular)
            turned = add(scale(2, w_parent), joint.w)
            slid = add(cross(a, angular), apply(spread(alpha_parent, w_parent), linear))
            of_q = _Change(
                add(slid, add(here.a, cross(scale(2, w_parent), here.v))),
                add(apply(spread(alpha, w), angular), add(here.alpha, cross(turned, here.w))),
                add(cross(w, angular), here.w),
            )
            if self.hold and index in self.free:
                self.shifts[k], of_q = of_q.a, replace(of_q, a=ZERO_VECTOR)
            bias, angular_bias = joint.bias_rates(place)
            of_u = _Change(
                add(cross(scale(2, w_parent), linear), bias), add(cross(turned, angular), angular_bias), angular
            )
            found.append(_Freedom(k, linear, angular, of_q, of_u, partials))
        return found


@dataclass(frozen=True)
class _JointRates:
    """How a joint's own velocities v, w and accelerations a, alpha change with a coordinate, seen from the parent."""

    v: Vec
    w: Vec
    a: Vec
    alpha: Vec


@dataclass(frozen=True)
class _Joint:
    """A joint as it moves on a parent at rest, in the body's axes, and the slots of its coordinates and speeds.

    One that is `free` slides along fixed axes before it turns.
    """

    moved: BodyMotion
    ways: tuple[dict[Node, Node], ...]
    speeds: tuple[Node, ...]
    udot: tuple[S, ...]
    free: bool

    @staticmethod
    def of(motion: Motion, index: int, udot: Sequence[S], free: bool) -> _Joint:
        body, state = motion.mechanism.bodies[index], motion.state
        ways = []
        for k in body.u:
            rates = joint_rates(body, state.q, [int(j == k) for j in range(len(state.u))])
            ways.append({state.q[i]: as_node(rate) for i, rate in zip(body.q, rates, strict=True)})
        speeds = tuple(state.u[k] for k in body.u)
        return _Joint(body_motion(body, _STILL, state), tuple(ways), speeds, tuple(udot[k] for k in body.u), free)

    @property
    def w(self) -> Vec:
        """The angular velocity relative to the parent."""
        return add(combination(self.moved.angular, self.speeds), self.moved.given_angular)

    @property
    def v(self) -> Vec:
        """The velocity relative to the parent."""
        return add(combination(self.moved.linear, self.speeds), self.moved.given_linear)

    def along(self, place: int, theta: Vec) -> tuple[_JointRates, tuple[tuple[Vec, Vec], ...]]:
        """Return the changes as one speed alone is one, and those of all partial velocities, seen from the body."""
        moved, count = self.moved, len(self.speeds)
        slides = [*[ZERO_VECTOR] * 3, *moved.linear[3:]] if self.free else moved.linear
        vectors = [*slides, *moved.angular, moved.given_linear, moved.given_angular]
        vectors += [moved.linear_bias, moved.angular_bias]
        rates = _tangents(vectors, self.ways[place])
        seen = [add(x, cross(theta, y)) for x, y in zip(rates, vectors, strict=True)]
        linear, angular, (v, w, bias, angular_bias) = seen[:count], seen[count : 2 * count], seen[2 * count :]
        found = _JointRates(
            v=add(combination(linear, self.speeds), v),
            w=add(combination(angular, self.speeds), w),
            a=add(combination(linear, self.udot), bias),
            alpha=add(combination(angular, self.udot), angular_bias),
        )
        return found, tuple(zip(rates[:count], rates[count : 2 * count], strict=True))

    def bias_rates(self, place: int) -> tuple[Vec, Vec]:
        """Return how the joint's accelerations without udot change with a speed."""
        linear, angular = _tangents([self.moved.linear_bias, self.moved.angular_bias], {self.speeds[place]: ONE})
        return linear, angular


def _tangents(vectors: Sequence[Vec], seeds: dict[Node, Node]) -> list[Vec]:
    rates = iter(tangents([as_node(x) for vector in vectors for x in vector], seeds))
    return list(zip(rates, rates, rates, strict=True))
