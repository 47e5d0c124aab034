"""A quick look at the numbers of a start: a Program that clears those with which nothing can be wrong.

It serves trees with free joints and without one-way elements, which start as declared. It reports no mistakes: numbers
that it does not clear, and starts whose runs fail, are checked in full (`number_checks`, `start`). It is stricter than
the full checks, so that rounding does not let it clear what they refuse.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

from multibody_sym.dynamics.formalisms.articulated_body import eliminate_joint, tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.formalisms.inertia import about_origin, articulated_inertia
from multibody_sym.dynamics.programs.closing import closes_by_programs
from multibody_sym.dynamics.programs.repeated_bodies import BodyKind, pack_inertia, unpack_inertia, worth_scanning
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import body_mass, body_motion, motion_of, moving_parent
from multibody_sym.mechanics.state import arrays, slot_state
from multibody_sym.mechanics.variable_mass import varies
from multibody_sym.model.system import System, expressions
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.program.tree_passes import Pass, Result, Values, scan_tree
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.vectors import ZERO_VECTOR, dot

FINITE, POSITIVE = "finite", "positive"
_DEFINED: Final = frozenset({"neg", "add", "mul", "abs", "sign", "min", "max", "sin", "cos", "atan", "tanh", "table"})
"""Operations that have a value for all finite numbers; the results of others are checked."""
_ROUNDING: Final = 1e-7
"""Relative: so far a moment of inertia may miss a possible one; the full check allows ten times more."""
_ARTICULATED: Final = 21
"""Numbers of an inertia that free joints are left out of."""
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
        pivots = [freedom.pivot for of_body in tree_factors(motion).freedoms for freedom in of_body]
        diagonals = zip(pivots, mass_diagonal(motion), strict=True)
        positive += [as_node(pivot) - _PIVOT * diagonal for pivot, diagonal in diagonals]
    else:  # by one pass inward: a long tree compiles for seconds
        carried = Pass("carried", tuple(body.parent for body in mechanism.bodies), 2 * _ARTICULATED)
        result = Result("pivots", len(mechanism.speeds), tuple(min(body.u, default=0) for body in mechanism.bodies))
        given = [tuple(trace[array.name]) for array in trace.inputs]
        step = partial(_pivots_of_body, like.kinds)
        positive += scan_tree(trace, given, like.bodies, [carried], [result], step)["pivots"]
    positive = positive or [as_node(1)]
    outputs = {FINITE: ((len(finite),), finite), POSITIVE: ((len(positive),), positive)}
    return trace.finish(outputs)


def _partial_values(system: System, mechanism: Mechanism) -> Iterator[Node]:
    """Yield the parts of written expressions that may have no value at the start, and their values."""
    inputs = {slot("inputs", k): node for k, node in enumerate(mechanism.inputs.values())}
    known = {**mechanism.symbols, TIME: ZERO}
    for written in expressions(system):
        named = leaves([written.node], "symbol", "quantity")
        if written.node.shadow is not None or not all(leaf in mechanism.symbols for leaf in named):
            continue
        (node,) = evaluate([written.node], lambda leaf: known.get(leaf, leaf))
        while any(leaf in inputs for leaf in leaves([node], "slot")):
            (node,) = evaluate([node], lambda leaf: inputs.get(leaf, leaf))
        (node,) = evaluate([node], lambda leaf: known.get(leaf, leaf))
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
    little = _ROUNDING * trace
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


def _pivots_of_body(kinds: Sequence[BodyKind], number: int, read: Values) -> Values:
    """Return the inertias that a body hands on, with free and with rigid joints, and its pivots."""
    kind = kinds[number]
    body, state = kind.body, kind.state
    moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
    own = articulated_inertia(about_origin(body_mass(body, state)))
    rigid = own.plus(unpack_inertia(read["carried"][_ARTICULATED:]))
    freedoms, left = eliminate_joint(body.u, moved, own.plus(unpack_inertia(read["carried"][:_ARTICULATED])))
    found = []
    for freedom, linear, angular in zip(freedoms, moved.linear, moved.angular, strict=True):
        force, moment = rigid.wrench(linear, angular)
        found.append(as_node(freedom.pivot) - _PIVOT * (dot(linear, force) + dot(angular, moment)))
    handed = (*pack_inertia(left.moved(moved.R_PB, moved.p_PB)), *pack_inertia(rigid.moved(moved.R_PB, moved.p_PB)))
    return {"carried": handed, "pivots": found}
