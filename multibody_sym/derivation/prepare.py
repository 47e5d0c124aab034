"""What every derivation in closed form begins with.

In: a System or a Mechanism. Out: the mechanism at its start with its symbols, the constants that a run measures there,
and the sides on which ropes and springs lie; then the choice between expressions written out and named parts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import is_dataclass, replace
from math import comb
from typing import Any, Final, Protocol, TypeVar

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import LARGEST_SUM, Readable, Subexpressions, WrittenOut, tidy_definitions
from multibody_sym.derivation.free_bodies import FreeBodies, describe_forces
from multibody_sym.derivation.lagrange import (
    Energies,
    LagrangeTerms,
    RowTerms,
    energies,
    energy_nodes,
    known_nodes,
    totals,
)
from multibody_sym.derivation.notation import READABLE, Equation, Label, Notation, Step, Symbols, symbols_of, upright
from multibody_sym.dynamics.start.initial_geometry import SignedLength, fix_directions
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.errors import ArgumentError, MultibodyError, short_repr
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.forces import flow_wrench, mass_rates
from multibody_sym.mechanics.load_records import MassFlow
from multibody_sym.mechanics.mechanism import (
    ARRAY,
    Measure,
    Mechanism,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    WrapAngle,
)
from multibody_sym.mechanics.motion import motion_of, slot_state
from multibody_sym.mechanics.points import position, velocity
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.bodies import GROUND, Pose
from multibody_sym.model.system import System, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate, substitute
from multibody_sym.scalars.node import ZERO, Node, as_node, slot
from multibody_sym.scalars.numbers import number
from multibody_sym.scalars.vectors import ZERO_VECTOR, apply
from multibody_sym.stages import doing
from multibody_sym.text.printer import text
from multibody_sym.text.printer import text as in_model_language

SIDES: Final = "Sides at the start, on which these equations hold"
_READABLE_ENERGY: Final = 300
"""Operations in T up to which the equations that follow from it have a chance to be read."""


@dataclass(frozen=True)
class DerivationInput:
    """A mechanism in its state at the start, on the sides where things lie there, and its symbols.

    The book's letters by name, the values of constants of the start, and the sides on which equations hold.
    """

    mechanism: Mechanism
    symbols: Symbols
    labels: Mapping[str, str]
    constants: Mapping[Any, float]
    sides: tuple[SignedLength, ...]


def prepare(model: System | Mechanism, changes: Overrides) -> DerivationInput:
    """Return the input of a derivation, one-way elements in the mode of the start.

    Raises ModelError, NoSolutionError; ArgumentError for changes of a Mechanism.
    """
    labels: Mapping[str, str] = {}
    project = False
    if isinstance(model, System):
        model = changes.of(model)
        labels, project = letters_of(model), model.simulation.project
        mechanism = check_numbers(model)
        if mechanism.one_way:
            mechanism = state_at(mechanism, project=project).mechanism
    elif changes != Overrides():
        raise ArgumentError("a Mechanism is what follows from a System and is not changed; hand over the System")
    else:
        mechanism = model
    begin, sides, constants = None, tuple[SignedLength, ...](), dict[Any, float]()
    lines = (*(row.line for row in mechanism.rows), *(load.line for load in mechanism.loads))
    if any(entry.measure for entry in mechanism.parameters) or any(lines):  # measured there, or on a side
        with suppress(MultibodyError):
            begin = start(mechanism, project=project)
    if begin is not None:
        mechanism = _without_zero_angles(mechanism, begin)
        mechanism, sides = fix_directions(mechanism, begin.q, begin.u, begin.parameters)
    symbols = symbols_of(mechanism)
    if begin is not None:
        values = zip(symbols.parameters, mechanism.parameters, begin.parameters, strict=True)
        constants = {symbol: value for symbol, entry, value in values if entry.measure is not None}
    return DerivationInput(mechanism, symbols, labels, constants, sides)


def budget_of(value: object) -> Budget:
    """Return a budget, of the seconds that are given; raises ArgumentError."""
    if value is None or isinstance(value, Budget):
        return value or Budget()
    seconds = number("budget", value)
    if not seconds > 0.0:
        raise ArgumentError(f"budget is a time in seconds, got {short_repr(value)}")
    return Budget(seconds=seconds)


# --- constants of the start: a letter, its value beside it; zero where it is zero whatever the parameters are --------


def _without_zero_angles(mechanism: Mechanism, begin: Start) -> Mechanism:
    """Return the mechanism with zero in place of the angles of tangents that are zero whatever the parameters are.

    That is known where the plane's body is not turned by declared numbers alone, which no assembly changed.
    """
    zeros = {
        slot(ARRAY, k): ZERO
        for k, entry in enumerate(mechanism.parameters)
        if isinstance(entry.measure, TangentAngle)
        and begin.parameters[k] == 0.0
        and _is_numeric(mechanism, begin, entry.measure)
    }
    if not zeros:
        return mechanism
    rows = with_expressions(mechanism.rows, lambda node: substitute(node, zeros))
    return replace(mechanism, rows=rows)


def _is_numeric(mechanism: Mechanism, begin: Start, measure: TangentAngle) -> bool:
    """Return whether a plane and all joints between its body and ground are at declared numbers at the start."""
    if any(x.shadow is None for x in measure.normal):
        return False
    index = measure.plane.body
    while index >= 0 and mechanism.bodies[index].name != GROUND:
        body = mechanism.bodies[index]
        coordinates = [mechanism.coordinates[k] for k in body.q]
        turns = [x for frame in (body.frame_on_parent, body.frame_on_body) for row in frame.rotation for x in row]
        given = [step.motion for step in body.steps if step.motion is not None]
        given += [x for step in body.steps if step.curve is not None for x in step.curve.place]
        if (
            any(c.initial.shadow is None or c.name in begin.assembled for c in coordinates)
            or any(x.shadow is None for x in turns)
            or any(leaf.data[0] == ARRAY for leaf in leaves(given, "slot"))
        ):
            return False
        index = body.parent
    return True


def constants_step(mechanism: Mechanism, symbols: Symbols, values: Mapping[Any, float]) -> tuple[Step, ...]:
    """Return the step with what is measured at the start; nothing where equations hold no such constant."""
    named: set[Node] = set()

    def keep(node: Node) -> Node:
        named.update(leaves([node], "slot"))
        return node

    with_expressions(mechanism.rows, keep)
    shown = [
        (symbol, entry.measure)
        for k, (symbol, entry) in enumerate(zip(symbols.parameters, mechanism.parameters, strict=True))
        if entry.measure is not None and slot(ARRAY, k) in named
    ]
    equations = []
    for symbol, measure in shown:
        if symbol in values:
            value, unit = f"{values[symbol]:.10g}", measure.unit
            equations.append(Equation(symbol, Label(f"{value} {unit}", rf"{value}\,\mathrm{{{unit}}}")))
    notes = [f"{symbol}: {_meaning_of(mechanism, measure)}" for symbol, measure in shown]
    return (Step("Constants of the start", tuple(equations), "\n".join(notes)),) if shown else ()


def _meaning_of(mechanism: Mechanism, measure: Measure) -> str:
    if isinstance(measure, RopeLength):
        return f"how long {measure.row} is at the start" + (", less what turned wheels have wound" * measure.winds)
    if isinstance(measure, RopeSide):
        return f"on which side of {measure.pulley} {measure.rope} runs: 1 to the left about the axis, or -1"
    if isinstance(measure, WrapAngle):
        return f"around how much of its wheel the rope of {measure.row} lies at the start"
    if isinstance(measure, TangentDirection):
        return f"at what angle {measure.row} meets its wheel at the start"
    name_of = {leaf: name for name, leaf in mechanism.symbols.items()}
    components = evaluate(list(measure.across), lambda leaf: name_of.get(leaf, leaf))
    vector = ", ".join(text(component) for component in components)
    return f"from [{vector}] on {measure.plane.name} about its normal to t1, which is ground's x at the start"


# --- written out, or with names --------------------------------------------------------------------------------------


class _Sized(Protocol):
    @property
    def operations(self) -> int: ...


R = TypeVar("R", bound=_Sized)


def readable(symbols: Symbols, mechanism: Mechanism) -> Readable:
    """Return how a person writes expressions in the symbols: squares of speeds, quaternions of length one."""
    circles = tuple(tuple(symbols.coordinates[k] for k in q) for b in mechanism.bodies for q in b.quaternions)
    return Readable(frozenset(symbols.speeds), circles)


def shortest(ready: DerivationInput, limits: Budget, derive: Callable[[Subexpressions, Energies], R]) -> R:
    """Return what `derive` makes of the energies: written out where a person can read it, else with named parts."""
    mechanism, symbols = ready.mechanism, ready.symbols
    # the terms that expressions have at most once their products are multiplied out
    roots = [node for part in energy_nodes(mechanism) for node in part]
    sizes: dict[Node, int] = {}
    for n in postorder(roots):
        operands = [sizes[a] for a in n.args]
        if n.op == "add":
            sizes[n] = sum(operands)
        elif n.op == "mul":
            sizes[n] = operands[0] * operands[1]
        elif n.op == "pow" and isinstance(n.args[1].data, int) and n.args[1].data > 0:
            sizes[n] = comb(operands[0] + n.args[1].data - 1, n.args[1].data)
        else:
            sizes[n] = operands[0] if n.op in ("neg", "div") else 1
    if sum(sizes[root] for root in roots) <= LARGEST_SUM:
        names = WrittenOut(symbols.free_prefix, limits, readable(symbols, mechanism))
        given = energies(mechanism, symbols, names)
        if given.kinetic.count_ops() <= _READABLE_ENERGY:
            short = derive(names, given)
            if short.operations <= READABLE:
                return short
    doing(f"derive {mechanism.name} with named parts, as a person could not read it written out")
    named = Subexpressions(symbols.free_prefix, limits)
    return derive(named, energies(mechanism, symbols, named))


def map_expressions(part: Any, change: Callable[[Any], Any]) -> Any:
    """Return a record, list or tuple with every sympy expression in it changed."""
    if isinstance(part, sympy.Basic):
        return change(part)
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{name: map_expressions(x, change) for name, x in vars(part).items()})
    return type(part)(map_expressions(x, change) for x in part) if type(part) in (list, tuple) else part


def tidy_record(definitions: Mapping[Any, Any], part: Any, prefix: str) -> tuple[list[tuple[Any, Any]], Any]:
    """Return the definitions that a record's expressions rest on, numbered anew, and the record in their names."""
    roots: list[Any] = []

    def keep(e: Any) -> Any:
        roots.append(e)
        return e

    map_expressions(part, keep)
    kept, replaced = tidy_definitions(definitions, roots, prefix)
    return kept, map_expressions(part, lambda e: e.xreplace(replaced))


# ----------------------------------------------------------------------------------------------------------------------
# The steps of a derivation as a student writes them: coordinates, positions, energies, derivatives, rows, matrices.
#
# In: the parts of equations in sympy. Out: Steps, to be written as text or LaTeX.



_LONG: Final = 500
DISSIPATION: Final = "Rayleigh's function"
_RAYLEIGH: Final = "half the power that dampers take; -dD/du is their part of the generalised forces"
_MESHCHERSKY: Final = (
    "Meshchersky: m dv/dt = F + Phi, Phi the reactive force of what leaves or joins; T and V are differentiated with "
    "the masses of the instant held"
)
_TURNING: Final = (
    "Of an angular velocity omega = 2 E(q) q', the projection N^T (d/dt dT/dq' - dT/dq), N = E^T/2, gives "
    "d/dt dT/domega + omega x dT/domega - N^T dT/dq; the multiplier of |q| = 1 drops out because N^T q = 0."
)
_NOTHING_ACTS: Final = "neither inertia nor loads: its reactions are those of the joints it carries"


def coordinate_step(mechanism: Mechanism) -> Step:
    """Return what the coordinates are, joint by joint."""
    lines = []
    for body in mechanism.bodies:
        q = ", ".join(mechanism.coordinates[k].name for k in body.q)
        if body.quaternions:
            u = ", ".join(mechanism.speeds[k].name for k in body.u)
            lines.append(f"{body.joint_name}: {q} (a unit quaternion last), speeds {u} (angular velocity in body axes)")
        elif q:
            lines.append(f"{body.joint_name}: {q}")
    return Step("Coordinates", note="\n".join(lines))


# --- positions -------------------------------------------------------------------------------------------------------


def position_steps(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> tuple[Step, ...]:
    """Return position and velocity of each centre of mass (ground's axes), and angular velocities (body axes).

    Then each mass that varies, its rate, and the force of what leaves or joins (ground's axes).
    """
    motion = motion_of(mechanism, slot_state(mechanism))
    places = []
    for index, body in enumerate(mechanism.bodies):
        turns = any(x is not ZERO for x in body.mass.inertia)
        if body.mass.mass is ZERO and not turns:
            continue
        centre, of = Marker(body.name, index, Pose(body.mass.com)), upright(body.name)
        vectors = [
            (Label(f"r_{body.name}", f"r_{{{of}}}"), position(motion, centre)),
            (Label(f"v_{body.name}", f"v_{{{of}}}"), velocity(motion, centre)),
        ]
        if turns:
            vectors.append((Label(f"omega_{body.name}", rf"\omega_{{{of}}}"), motion.bodies[index].w_WB))
        places += [
            Equation(label, _vector(vector, mechanism, symbols, names))
            for label, vector in vectors
            if vector != ZERO_VECTOR
        ]
    masses, known = [], known_nodes(mechanism, symbols)
    for load in (load for load in mechanism.loads if isinstance(load, MassFlow)):
        of = upright(load.name)
        rate = mass_rates(motion, load.body).mass
        mass, rate = names.translated([as_node(motion.masses[load.body].mass), as_node(rate)], known)
        force = apply(motion.rotation(load.body), flow_wrench(load, motion)[0])
        masses += [
            Equation(Label(f"m_{load.name}", f"m_{{{of}}}"), names.name(mass)),
            Equation(Label(f"dm_{load.name}/dt", rf"\frac{{d}}{{dt}} m_{{{of}}}"), names.name(rate)),
            Equation(Label(f"Phi_{load.name}", rf"\Phi_{{{of}}}"), _vector(force, mechanism, symbols, names)),
        ]
    step = Step("Positions and velocities", tuple(places))
    return (step, Step("Masses that vary", tuple(masses), _MESHCHERSKY)) if masses else (step,)


def _vector(vector: Sequence[Any], mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> Any:
    components = names.translated([as_node(x) for x in vector], known_nodes(mechanism, symbols))
    return sympy.ImmutableMatrix(1, 3, [names.name(x) for x in components])


# --- energies and forces ---------------------------------------------------------------------------------------------


def energy_steps(mechanism: Mechanism, symbols: Symbols, given: Energies, notation: Notation) -> tuple[Step, ...]:
    """Return T, V, Rayleigh's function of dampers, and the generalised forces of the loads that V does not hold."""
    equations = []
    for by, force in _by_coordinate(mechanism, symbols, totals(given.forces, len(symbols.speeds))):
        if force != 0:
            label = Label(f"Q_{notation.text(by)}", f"Q_{{{notation.latex(by)}}}")
            equations.append(Equation(label, force))
    kinetic = Step("Kinetic energy", (Equation(Label("T", "T"), given.kinetic),))
    potential = Step("Potential energy", (Equation(Label("V", "V"), sympy.Add(*given.potential)),))
    note = "by virtual work of all loads that V does not hold" if equations else "V holds all loads"
    # each input with its declared expression, in the model's words; of what is long the size alone
    symbol_of = {slot: symbol for symbol, slot in mechanism.symbols.items()}
    written = evaluate(list(mechanism.inputs.values()), lambda leaf: symbol_of.get(leaf, leaf))
    lines = []
    for name, node in zip(mechanism.inputs, written, strict=True):
        if node.op == "table":
            function, _ = node.data
            between = "straight lines" if function.kind == "linear" else "natural cubic spline"
            words = f"{between} through {len(function.rows)} rows over {in_model_language(node.args[0])}"
        else:
            words = in_model_language(node)
        lines.append(f"{name} = {words if len(words) <= _LONG else f'... ({len(words)} characters)'}")
    notes = "\n".join([note, *lines])
    forces = Step("Generalised forces", tuple(equations), notes)
    if given.dissipation is None:
        return kinetic, potential, forces
    lost = Equation(Label("D", "D"), given.dissipation)
    return kinetic, potential, Step(DISSIPATION, (lost,), _RAYLEIGH), forces


def _by_coordinate(mechanism: Mechanism, symbols: Symbols, values: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return (coordinate, or speed where it is no coordinate's rate; value) by speed."""
    shown: list[Any] = list(symbols.speeds)
    for body in mechanism.bodies:
        for q, u in body.rate_pairs:
            shown[u] = symbols.coordinates[q]
    return list(zip(shown, values, strict=True))


# --- derivatives -----------------------------------------------------------------------------------------------------


def lagrange_steps(
    mechanism: Mechanism, symbols: Symbols, notation: Notation, terms: LagrangeTerms
) -> tuple[Step, ...]:
    """Return dT/du, its rate, dT/dq and dV/dq."""
    by_speed = [_partial("T", u, notation) for u in symbols.speeds]
    momenta = [Equation(label, p) for label, p in zip(by_speed, terms.momenta, strict=True)]
    rates = []
    for k, label in enumerate(by_speed):
        text, latex = f"d/dt {label.text}", rf"\frac{{d}}{{dt}} {label.latex}"
        if terms.turning[k] != 0:
            text, latex = text + " + omega x dT/domega", latex + r" + \omega \times \frac{\partial T}{\partial \omega}"
        inertia = [m * a for m, a in zip(terms.mass_matrix[k], symbols.accelerations, strict=True)]
        rates.append(Equation(Label(text, latex), sympy.Add(*inertia, terms.momentum_rates[k], terms.turning[k])))
    return (
        Step("Momenta", tuple(momenta)),
        Step("Their rates", tuple(rates), _TURNING if any(b.quaternions for b in mechanism.bodies) else ""),
        Step("Gradient of T", _energy_gradient("T", mechanism, symbols, notation, terms.kinetic_gradient)),
        Step("Gradient of V", _energy_gradient("V", mechanism, symbols, notation, terms.potential_gradient)),
    )


def _partial(of: str, by: Any, notation: Notation) -> Label:
    return Label(f"d{of}/d{notation.text(by)}", rf"\frac{{\partial {of}}}{{\partial {notation.latex(by)}}}")


def _energy_gradient(
    of: str, mechanism: Mechanism, symbols: Symbols, notation: Notation, values: Sequence[Any]
) -> tuple[Equation, ...]:
    """Return dT/dq of each speed, or the component of N^T dT/dq that belongs to an angular velocity."""
    equations = []
    for by, x in _by_coordinate(mechanism, symbols, values):
        label = _partial(of, by, notation)
        if by not in symbols.coordinates:
            latex = rf"\left(N^T \frac{{\partial {of}}}{{\partial q}}\right)_{{{notation.latex(by)}}}"
            label = Label(f"(N^T d{of}/dq)_{notation.text(by)}", latex)
        equations.append(Equation(label, x))
    return tuple(equations)


# --- bodies cut free -------------------------------------------------------------------------------------------------


def free_body_steps(
    mechanism: Mechanism, symbols: Symbols, bodies: FreeBodies, rows: Sequence[RowTerms], notation: Notation
) -> tuple[Step, ...]:
    """Return the meaning of letters, each body's balances, free directions, and what the rows demand."""
    forces = describe_forces(mechanism, symbols, bodies.unknown)
    named = "\n".join(f"{notation.text(s)}: {words}" for s, words in forces.items())
    steps = [Step("Forces", note=named)] if named else []
    steps += [
        Step(f"Body {name}", balances, _NOTHING_ACTS if not balances else "")
        for name, balances in zip(bodies.names, bodies.balances, strict=True)
    ]
    if bodies.joints:
        steps.append(Step("Free directions", bodies.joints, "along them a joint transmits nothing but its drives"))
    demands = [
        Equation(sympy.Add(*(h * a for h, a in zip(row.jacobian, symbols.accelerations, strict=True))), row.gamma)
        for row in rows
    ]
    return (*steps, Step("Accelerations of the constraints", tuple(demands))) if demands else tuple(steps)


# --- rows and matrices -----------------------------------------------------------------------------------------------


def row_steps(mechanism: Mechanism, rows: Sequence[RowTerms]) -> tuple[Step, ...]:
    """Return phi = 0 of each row and its rate, or psi = 0 of a nonholonomic one."""
    if not rows:
        return ()
    equations = []
    for row, terms in zip(mechanism.rows, rows, strict=True):
        of = upright(row.name)
        if terms.phi is None:
            equations.append(Equation(Label(f"psi_{row.name}", rf"\psi_{{{of}}}"), terms.phidot))
            continue
        equations += [
            Equation(Label(f"phi_{row.name}", rf"\varphi_{{{of}}}"), terms.phi),
            Equation(Label(f"d/dt phi_{row.name}", rf"\dot{{\varphi}}_{{{of}}}"), terms.phidot),
        ]
    return (Step("Constraints", tuple(equations), "phi = 0; the multiplier is positive for a pulling rope or rod"),)


def matrix_step(M: Any, f: Any, H: Any, gamma: Any, C: Any, D: Any) -> Step:
    """Return the matrix form; C and D are None where multipliers exert H^T lambda and define no force."""
    shown = [Equation(Label("M", "M"), M), Equation(Label("f", "f"), f)]
    if not H.rows:
        return Step("Matrix form", tuple(shown), "M u' = f")
    shown += [Equation(Label("H", "H"), H), Equation(Label("gamma", r"\gamma"), gamma)]
    if C is None:
        return Step("Matrix form", tuple(shown), "M u' = f + H^T lambda, H u' = gamma")
    shown += [Equation(Label("C", "C"), C), Equation(Label("D", "D"), D)]
    return Step("Matrix form", tuple(shown), "M u' = f + C^T lambda, H u' + D lambda = gamma")
