"""The general theorems in symbols: momentum, angular momentum and energy, with every term of both sides named.

    dp/dt = sum F        dL/dt = sum M about the origin        d(T + V)/dt = sum of powers outside V

What joints on ground exert is unknown and has letters: R the force, M the moment about the origin.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, TypeVar

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import WrittenOut, value_of
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.lagrange import known_nodes
from multibody_sym.derivation.notation import Derivation, Equation, Label, Step
from multibody_sym.derivation.prepare import readable
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, SymbolicEquations
from multibody_sym.dynamics.balance import idle_reactions
from multibody_sym.dynamics.conserved import Conserved, conserved_quantities
from multibody_sym.dynamics.programs.quantities import angular_momentum, body_momenta, momentum, power_of, resultant
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.energy import split
from multibody_sym.mechanics.forces import applied_forces, carried_by_flows, carried_momentum
from multibody_sym.mechanics.load_records import Load, MassFlow
from multibody_sym.mechanics.mechanism import TreeBody
from multibody_sym.mechanics.motion import Motion, motion_of, slot_state
from multibody_sym.mechanics.points import Wrench
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import AngleRow, ContactRow, DistanceRow, PositionRow, RopeRow
from multibody_sym.model.bodies import IDENTITY, ORIGIN
from multibody_sym.model.fields import AXES
from multibody_sym.model.system import System
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S, add
from multibody_sym.text.parser import WEIGHT

CONSERVED: Final = "Conserved"
"""The title of the step with the conserved quantities."""
_ALL: Final = 3
_PLACED: Final = (PositionRow, AngleRow, DistanceRow, RopeRow, ContactRow)
"""Rows whose forces act where they say."""
LONGEST: Final = 400
"""Operations of a term up to which it is rewritten as a person would."""


E = TypeVar("E", bound=SymbolicEquations | CanonicalEquations)


def theorems(
    system: System,
    method: str | None = None,
    *,
    formalism: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    budget: Budget | float | None = None,
) -> SymbolicEquations | CanonicalEquations:
    """Return the equations of motion whose steps go on with the general theorems and the conserved quantities.

    Momentum, angular momentum about the origin and energy in ground's axes, every term of both sides with its name;
    arguments are those of `derive`. Quantities are conserved for the system's values, from its start on. Raises
    InputError and NoSolutionError as `derive` does.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    equations = derive(changed, method, formalism=formalism, budget=budget)
    return with_theorems(equations, conserved_quantities(changed))


def with_theorems(equations: E, kept: Sequence[Conserved] = ()) -> E:
    """Return equations whose steps go on with the theorems, and with the conserved quantities."""
    theorem = _Theorems(equations)
    steps: Derivation = (*theorem.of_vectors(), theorem.of_energy())
    if kept:
        steps = (*steps, Step(CONSERVED, (), "\n".join(f"{x.name}: {x.symmetry}" for x in kept)))
    plain, count = equations.notation, len(equations.notation.places)
    places = {**plain.places, **{term: (99, count + k) for k, term in enumerate(theorem.named)}}
    notation = replace(plain, spelling={**plain.spelling, **theorem.named}, places=places)
    return replace(equations, steps=(*equations.steps, *steps), notation=notation)


class _Theorems:
    """The theorems, and how their `named` terms are written, by symbols."""

    def __init__(self, equations: SymbolicEquations | CanonicalEquations) -> None:
        self._equations = equations
        self._mechanism = equations.mechanism
        self._motion: Motion = motion_of(self._mechanism, slot_state(self._mechanism))
        self._known = known_nodes(self._mechanism, equations.symbols)
        self._rows = row_motions(self._motion)
        self._idle = idle_reactions(self._mechanism)
        simplify = readable(equations.symbols, self._mechanism)
        self._names = WrittenOut(equations.symbols.free_prefix, Budget(), simplify)
        self.named: dict[Any, Label] = {}

    def of_vectors(self) -> Derivation:
        """Return the theorems of momentum and of angular momentum about the origin."""
        parts = body_momenta(self._motion)
        acting = self._wrenches()
        joints = [body for body in self._mechanism.bodies if body.parent < 0]
        about = [
            ("Theorem of momentum", "p", "F", "R", momentum(parts), [(name, x[:3]) for name, x in acting]),
            ("Theorem of angular momentum about the origin", "L", "M", "M",
             angular_momentum(parts), [(name, x[3:]) for name, x in acting]),
        ]  # fmt: skip
        return tuple(
            Step(title, tuple(e for k in range(3) for e in self._component(k, letters, vector[k], causes, joints)))
            for title, *letters, vector, causes in about
        )

    def _component(
        self, k: int, letters: Sequence[str], value: S, causes: Sequence[tuple[str, Any]], joints: Sequence[TreeBody]
    ) -> list[Equation]:
        """Return the equations along an axis: the quantity, each cause by its name, and the theorem."""
        if as_node(value) is ZERO:
            return []
        quantity, own, reaction = letters
        left = Label(f"{quantity}_{AXES[k]}", f"{quantity}_{AXES[k]}")
        found, total = [Equation(left, self._sympy(value))], sympy.S.Zero
        for name, vector in causes:
            if vector[k] != 0:
                term = self._name(own, name, AXES[k])
                found.append(Equation(self.named[term], vector[k]))
                total += term
        exerting = [body.joint_name for body in joints if self._exerts(body, k, turning=quantity == "L")]
        total += sum(self._name(reaction, name, AXES[k]) for name in exerting)
        rate = Label(f"d{left.text}/dt", rf"\frac{{\mathrm{{d}} {left.latex}}}{{\mathrm{{d}} t}}")
        return [*found, Equation(rate, total)]

    def of_energy(self) -> Step:
        """Return d(T + V)/dt as the sum of the powers of what V does not hold."""
        found, total = [], sympy.S.Zero
        for name, power in self._powers():
            if power != 0:
                term = self._name("P", name, "")
                found.append(Equation(self.named[term], power))
                total += term
        for body in self._mechanism.bodies:
            if body.driven:
                total += self._name("P", body.joint_name, "")
        rate = Label("d(T + V)/dt", r"\frac{\mathrm{d}}{\mathrm{d} t}(T + V)")
        note = "" if found or total != 0 else "no force outside V does work"
        return Step("Theorem of energy", (*found, Equation(rate, total)), note)

    # --- what acts ------------------------------------------------------------------------------------------------

    def _wrenches(self) -> list[tuple[str, tuple[Any, ...]]]:
        motion, loads = self._motion, self._mechanism.loads
        acting = [(WEIGHT, applied_forces(motion, ()).of_body, sympy.S.One)]
        acting += [(load.name, self._exerted(load), sympy.S.One) for load in loads]
        rows = zip(self._mechanism.rows, self._rows, self._equations.symbols.multipliers, strict=True)
        acting += [(row.name, found.of_body, multiplier) for row, found, multiplier in rows]
        return [
            (name, tuple(factor * self._sympy(x) for vector in resultant(motion, of_body) for x in vector))
            for name, of_body, factor in acting
        ]

    def _exerted(self, load: Load) -> list[Wrench]:
        """Return what a load exerts, with the momentum that comes or goes with mass."""
        of_body = list(applied_forces(self._motion, [load], weight=False).of_body)
        if isinstance(load, MassFlow):
            (force, moment), more = of_body[load.body], carried_momentum(self._motion, load.body)
            of_body[load.body] = add(force, more[0]), add(moment, more[1])
        return of_body

    def _powers(self) -> list[tuple[str, Any]]:
        """Return the powers of loads outside V, and of rows that time moves or that rub, by name."""
        found: list[tuple[str, Any]] = []
        u = self._motion.state.u
        for load in split(self._mechanism.loads)[1]:
            forces = applied_forces(self._motion, [load], weight=False)
            along = sum((f * x for f, x in zip(forces.of_speed, u, strict=True)), 0)
            gained = carried_by_flows(self._motion, [load])
            found.append((load.name, self._sympy(power_of(self._motion, forces.of_body) + along + gained)))
        rows = zip(self._mechanism.rows, self._rows, self._equations.symbols.multipliers, strict=True)
        for row, moved, multiplier in rows:
            if moved.exerts is None:
                own = -as_node(evaluate([as_node(moved.phidot)], self._at_rest)[0])
            else:
                own = as_node(sum((f * x for f, x in zip(moved.exerts, u, strict=True)), 0))
            found.append((row.name, multiplier * self._sympy(own)))
        return found

    @staticmethod
    def _at_rest(leaf: Node) -> Node:
        return ZERO if leaf.op == "slot" and leaf.data[0] == "u" else leaf

    def _driven_by_rows(self, body: TreeBody) -> bool:
        """Return whether rows whose forces have no place of their own act in a joint's freedoms."""
        rows = zip(self._mechanism.rows, self._rows, strict=True)
        placeless = [found for row, found in rows if not isinstance(row, _PLACED)]
        return any(as_node(found.forces[k]) is not ZERO for found in placeless for k in body.u)

    def _exerts(self, body: TreeBody, k: int, *, turning: bool) -> bool:
        """Return whether a joint on ground may exert a force along an axis, or a moment about it through the origin."""
        if (body.joint_name, k + 3 * turning) in self._idle:
            return False
        acting = [load for load in self._mechanism.loads if getattr(load, "joint", None) == body.joint_name]
        rubs = any(each.joint == body.joint_name for each in self._mechanism.one_way)
        if acting or rubs or body.driven or self._driven_by_rows(body):
            return True
        if body.frame_on_parent.rotation is not IDENTITY:
            return any(len(axes) < _ALL for axes in _free_axes(body))
        slides, turns = _free_axes(body)
        if not turning:
            return k not in slides
        across = {0, 1, 2} - {k}
        return k not in turns or not (across <= slides or (body.frame_on_parent.position is ORIGIN and not slides))

    # --- symbols --------------------------------------------------------------------------------------------------

    def _name(self, letter: str, element: str, axis: str) -> Any:
        plain = re.sub(r"[^A-Za-z0-9]+", "_", element)
        text = "_".join(part for part in (letter, plain, axis) if part)
        under = ",".join(part for part in (rf"\mathrm{{{plain.replace('_', ' ')}}}", axis) if part)
        term = sympy.Symbol(text, real=True)
        self.named.setdefault(term, Label(text, f"{letter}_{{{under}}}"))
        return term

    def _sympy(self, value: S) -> Any:
        (found,) = self._names.translated([as_node(value)], self._known)
        found = found.xreplace({name: value_of(node) for name, node in self._names.numbers.items()})
        return self._names.name(found) if found.count_ops() <= LONGEST else found


def _free_axes(body: TreeBody) -> tuple[set[int], set[int]]:
    """Return the axes of its frame along which a joint slides freely, and those about which it turns first."""
    units = {tuple(as_node(int(j == k)) for j in range(3)): k for k in range(3)}
    free = (step for step, given in zip(body.steps, body.given, strict=True) if given is None)
    steps = [step for step in free if step.is_independent]
    slides = {units[axis] for step in steps for axis in step.slides if axis in units}
    turns = [axis for step in steps for axis in step.turns]
    if len(turns) >= _ALL:
        return slides, {0, 1, 2}
    return slides, {units[axis] for axis in turns[:1] if axis in units}
