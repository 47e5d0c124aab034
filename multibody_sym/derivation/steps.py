"""The steps of a derivation as a student writes them: coordinates, positions, energies, derivatives, rows, matrices.

In: the parts of equations in sympy. Out: Steps, to be written as text or LaTeX.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.simplify import Subexpressions
from multibody_sym.derivation.free_bodies import FreeBodies, describe_forces, force_letters
from multibody_sym.derivation.lagrange import Energies, LagrangeTerms, RowTerms, known_nodes, totals
from multibody_sym.derivation.notation import Equation, Label, Notation, Step, Symbols, upright
from multibody_sym.mechanics.forces import flow_wrench, mass_rates
from multibody_sym.mechanics.load_records import MassFlow
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, slot_state
from multibody_sym.mechanics.points import position, velocity
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import Pose
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, as_node
from multibody_sym.scalars.vectors import ZERO_VECTOR, apply
from multibody_sym.text.printer import text as in_model_language

_LONG: Final = 500
_T: Final = Label("T", "T")
_V: Final = Label("V", "V")
_D: Final = Label("D", "D")
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
    kinetic = Step("Kinetic energy", (Equation(_T, given.kinetic),))
    potential = Step("Potential energy", (Equation(_V, sympy.Add(*given.potential)),))
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
    lost = () if given.dissipation is None else (Step(DISSIPATION, (Equation(_D, given.dissipation),), _RAYLEIGH),)
    return kinetic, potential, *lost, Step("Generalised forces", tuple(equations), notes)


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


def with_force_letters(
    notation: Notation, mechanism: Mechanism, symbols: Symbols, bodies: FreeBodies | None
) -> Notation:
    """Return a notation in which the forces on bodies that are cut free have the letters of books."""
    if bodies is None:
        return notation
    letters = force_letters(mechanism, symbols, {*symbols.multipliers, *bodies.unknown})
    return replace(notation, spelling={**notation.spelling, **letters})


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
