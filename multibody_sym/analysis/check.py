"""`check`: whether a system is what its author means, and whether all routes to its equations agree.

In: a System. Out: a CheckReport with degrees of freedom, redundancy, residuals, conserved quantities and hints.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from math import hypot
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.hints import Hint, declared_hints, first_at_each_place
from multibody_sym.contact_laws.problem import Verdict
from multibody_sym.derivation.routes import FORMALISMS, MANY_SPEEDS, ROUTES, formalism_name
from multibody_sym.dynamics.balance import INTEGRAL, NEGLIGIBLE, THEOREMS, terms_at_states, theorems
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.conserved import MOST, find_conserved
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.dynamics.programs.quantities import angular_momentum, body_momenta, exertions, quantities, resultant
from multibody_sym.dynamics.redundancy import contradiction_of, redundancy
from multibody_sym.dynamics.start.declared_impact import from_impact
from multibody_sym.dynamics.start.initial_geometry import slipped_wheels
from multibody_sym.dynamics.start.number_checks import blame_numbers, check_numbers, end_of_run, holes, on_numbers
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start, sampled_states, verify_regular_start
from multibody_sym.dynamics.start.state import StartState, state_at
from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.declared_rows import with_driving_inputs
from multibody_sym.mechanics.energy import kinetic_energy
from multibody_sym.mechanics.forces import AppliedForces, apart, applied_forces, span
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.load_records import JointSpring, Load, PointSpring
from multibody_sym.mechanics.mechanism import TIME, Mechanism, normal_forces
from multibody_sym.mechanics.modes import taut_ropes
from multibody_sym.mechanics.motion import Motion, State, accelerations, motion_of, pose, state_of
from multibody_sym.mechanics.points import NO_WRENCH, velocity
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.row_kinematics import (
    along_reactions,
    constraint_jacobian,
    largest_wrenches,
    row_motions,
    row_terms,
)
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.constraints import Rope
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.system import System
from multibody_sym.motion.methods.explicit import dormand_prince_8
from multibody_sym.motion.results.integrals import limits_passed
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, slot, symbol
from multibody_sym.scalars.rank import ROUNDING, SWITCHED, rank
from multibody_sym.scalars.sign_changes import switching_functions
from multibody_sym.stages import counted, stage
from multibody_sym.text.parser import force_name

_OUT_OF_PLANE: Final = ("z", "rx", "ry")
"""ConstraintRows of joints across the plane of a plane model."""
_STATES: Final = 4
_AFTER: Final = "all this is of the motion after the impact, which solve tells"
_BEFORE: Final = (
    "all this is of the motion before the impact: the prescribed motion of {} jumps in it, and how it goes on is not "
    "declared; solve tells the speeds after it"
)


@dataclass(frozen=True)
class CheckReport:
    """The result of `check`.

    `rank` of the constraints at the start and the `redundant` rows, both without `doubles`: massless bodies by which
    joints keep their coordinates, with as many speeds as the joint, each held by a row of its own; `not_unique`: rows
    and joints whose forces are not determined; `dependencies`: for each redundant row the rows that follow from each
    other; `ambiguous`: elements whose forces are not determined, joints with the components, `ambiguous_forces` the
    names of these forces in expressions; `agreement`: each formalism's worst scaled residual (rounding is below 10,
    with constraints below 100); `theorems`: relative residuals, of rates at states and of changes along a short run
    (`impulse`, `angular_impulse`, `work`); `conserved` quantities, as outputs name them, and the `symmetries` that give
    them; `held` and `assembled` start values, by how much given ones changed (`shifts`), and the largest such `shift`;
    `failure`: why there is no start or no motion; `hints` for the author; `withheld`: components of joints' reactions
    that are not determined, as constraints do not say where their forces act, with the reasons; `missing`: formalisms
    and theorems whose residuals are more than rounding, so that `agrees` is false; `units`: of each coordinate and
    speed; `states`: of one-way elements at the start; `verdict`: "several" where the laws leave more than one motion,
    of which this is one; `others`: the states of the others.
    """

    degrees_of_freedom: int
    rank: int
    redundant: tuple[str, ...]
    not_unique: tuple[str, ...]
    dependencies: tuple[tuple[str, ...], ...] = ()
    ambiguous: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    ambiguous_forces: tuple[str, ...] = ()
    agreement: Mapping[str, float] = field(default_factory=dict)
    theorems: Mapping[str, float] = field(default_factory=dict)
    conserved: tuple[str, ...] = ()
    symmetries: Mapping[str, str] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    assembled: tuple[str, ...] = ()
    shifts: Mapping[str, float] = field(default_factory=dict)
    shift: float = 0.0
    agrees: bool = False
    failure: str | None = None
    hints: tuple[str, ...] = ()
    withheld: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    withheld_reasons: tuple[str, ...] = ()
    doubles: Mapping[str, int] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    states: Mapping[str, str] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    verdict: Verdict = "one"
    others: tuple[Mapping[str, str], ...] = ()

    def __repr__(self) -> str:
        if self.failure is not None:
            return f"<CheckReport: no motion, {self.failure}>"
        agreed = f"{len(self.agreement)} formalisms {'agree' if self.agrees else 'do not agree'}"
        return f"<CheckReport: {self.degrees_of_freedom} degrees of freedom, {agreed}, {len(self.hints)} hints>"

    def as_json(self) -> dict[str, Any]:
        """Return the object that `check --json` prints; without a start there are no numbers."""
        tree: dict[str, Any] = {name: list(x) if isinstance(x, tuple) else x for name, x in vars(self).items()}
        for name in ("agreement", "theorems"):
            tree[name] = {key: x if math.isfinite(x) else None for key, x in tree[name].items()}
        return tree if self.failure is None else {**tree, **dict.fromkeys(("degrees_of_freedom", "rank", "shift"))}


def check(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> CheckReport:
    """Return degrees of freedom, redundant constraints, the formalisms' agreement, theorems and hints for a system.

    `parameters` to `project` change the system for this call. Theorems and hints refer to the motion and forces of
    `formalism`, None for the cheapest; all formalisms that apply are compared.
    Raises InputError for values that contradict the declaration.
    """
    return _check(Overrides(parameters, initial, inputs, coordinates, project).of(system), formalism)


@on_numbers
def _check(system: System, formalism: str | None) -> CheckReport:
    resolved = check_numbers(system)
    chosen = formalism_name(formalism, resolved)
    base = resolved.relative or resolved
    until = f"t_end = {end_of_run(system, base, parameter_values(base, {})):g} s"
    hints: list[str] = [*declared_hints(system)]
    for name, joint in with_driving_inputs(system).joints.items():
        switches = switching_functions([x for x in getattr(joint, "motion", None) or () if x is not None])
        if symbol("t") in leaves(switches, "symbol"):
            told = f"the motion of joint {name} has kinks: until {until} neither it nor its rate jumps"
            hints.append(Hint(told, "joints", name, "motion"))
    hints += first_at_each_place(_edge_hints(system))
    declared = hints if system.outputs else [*hints, "no outputs are declared: a run tells coordinates and speeds only"]
    try:
        jumps = () if resolved.impact is None else [jump.joint or jump.name for jump in resolved.impact.jumps]
        if jumps:
            declared = [*declared, _BEFORE.format(", ".join(jumps))]
        elif resolved.impact is not None:
            resolved, declared = check_numbers(from_impact(system).system), [*declared, _AFTER]
        state = state_at(resolved, project=system.simulation.project)
        resolved, begin = state.mechanism, state.start
        verify_regular_start(resolved, begin)
    except NoSolutionError as error:
        count = len(resolved.speeds)
        failure = Hint(str(error), *error.where.path)
        return CheckReport(count, 0, (), (), failure=failure, hints=(*declared, *_massless_hint(system, error)))
    declared += _start_hints(system, state)
    report = _with_dynamics(system, resolved, begin, declared, FORMALISMS[chosen])
    return replace(report, states=state.words, verdict=state.verdict, others=state.others)


def _with_dynamics(
    system: System, resolved: Mechanism, begin: Start, declared: Sequence[str], formalism: Formalism
) -> CheckReport:
    states = sampled_states(resolved, begin, _STATES if len(resolved.speeds) <= MANY_SPEEDS else 0)
    motion = motion_of(resolved, states[0])
    rank = redundancy(motion, formalism(resolved, states[0]))
    compared = {name: f for name, f in FORMALISMS.items() if ROUTES[name].is_compared(resolved)}
    with stage("compare formalisms"):
        ratios = compare_formalisms(resolved, states, compared)
    with stage("verify theorems"):
        solved = [forward_dynamics(formalism(resolved, state)) for state in states]
        residuals = theorems(terms_at_states(resolved, states, solved))
        residuals |= short_run_misses(resolved, formalism, states[-1])
    if not all(map(math.isfinite, (*ratios.values(), *residuals.values()))):
        blame_numbers(system)
    masses = (x for body in resolved.bodies for x in (body.mass.mass, *body.mass.inertia))
    if all(x is ZERO for x in masses) and not resolved.loads:
        residuals = {}  # all forces are zero but for rounding: the theorems say that 0 is 0
    missed = [f"theorem of {name.replace('_', ' ')}" for name, x in residuals.items() if not x <= NEGLIGIBLE]
    missing = (*beyond_rounding(resolved, ratios), *missed)
    multipliers = dict(zip((row.name for row in resolved.rows), solved[0].multipliers.tolist(), strict=True))
    with stage("find what is conserved"):
        kept = {each.name: each.symmetry for each in find_conserved(resolved, begin)}
    return CheckReport(
        degrees_of_freedom=len(resolved.speeds) - sum(rank.doubles.values()) - rank.rank,
        rank=rank.rank,
        redundant=rank.redundant,
        not_unique=rank.not_unique,
        dependencies=rank.dependencies,
        ambiguous=rank.ambiguous,
        ambiguous_forces=rank.ambiguous_forces,
        agreement=ratios,
        theorems=residuals,
        conserved=tuple(kept),
        symmetries=kept,
        held=begin.held,
        assembled=begin.assembled,
        shifts=begin.shifts,
        shift=begin.shift,
        agrees=not missing,
        missing=missing,
        failure=_contradiction(resolved, begin, states) if missing else None,
        hints=(
            *declared,
            *_mechanism_hints(resolved, begin, states),
            *_reaction_hints(resolved, multipliers, rank.not_unique),
            *_structure_hints(system, resolved, rank),
        ),
        withheld={name: each.components for name, each in resolved.withheld.items()},
        withheld_reasons=tuple(reasons(resolved.withheld)),
        doubles=rank.doubles,
        units=MechanismUnits(resolved).state,
    )


def _contradiction(resolved: Mechanism, begin: Start, states: Sequence[State]) -> str | None:
    """Return the constraints that contradict each other at one of the states, so that no formalism has a solution."""
    generic = resolved.parameters.independent_rows(begin.parameters)
    for state in states if generic < len(resolved.rows) else ():
        t = float(state.slots[TIME])
        rows = ConstraintRows(resolved, begin.parameters, range(len(resolved.rows)), t)
        q, u = (np.array(x, dtype=float) for x in (state.q, state.u))
        found = contradiction_of(rows, q, u, generic)
        if found is not None:
            return found.message(resolved, f"at t = {t:.3g} s")
    return None


# --- hints -----------------------------------------------------------------------------------------------------------


def _edge_hints(system: System) -> Iterator[Hint]:
    """Yield contacts in space with a box whose edges touch no edges, sides of rods or rims."""
    for declared, name, contact in copies(system.contacts) if not in_plane(system) else ():
        bodies = [system.bodies.get(end) for end in contact.between]
        kinds = [body.shape.kind if body is not None and body.shape is not None else "" for body in bodies]
        if "box" not in kinds:
            continue
        box, other = contact.between if kinds[0] == "box" else contact.between[::-1]
        kind = kinds[contact.between.index(other)]
        if kind == "box":
            told = (
                f"edges of the boxes of contact {name} touch nothing, corners touch faces: where edges may cross, "
                f"declare a contact of both, such as between: [{box}.bottom_front, {other}.top_right]; a run tells "
                "where they pass"
            )
        elif kind == "rod":
            told = (
                f"the side of {other} does not touch the edges of {box} in contact {name}, its ends touch the faces: "
                f"where they may cross, declare a contact of both, such as between: [{other}.side, {box}.top_front]"
            )
        elif kind in ("disc", "cylinder"):
            told = (
                f"rims of {other} touch the faces of {box} in contact {name}, nothing of it the edges and corners: it "
                "passes through these"
            )
        else:
            continue
        yield Hint(told, "contacts", declared)


def _start_hints(system: System, state: StartState) -> list[str]:
    """Return what strikes, the gaps that no motion opens or closes, and ropes whose length changed start values."""
    hints: list[str] = [*filter(None, [state.strikes])]
    for element in [] if state.posed is None else state.posed.without_freedom:
        told = (
            f"joints and constraints alone determine the gap of {element.kind} {element.name}: no motion opens or "
            "closes it, and how much it carries follows from no law. Let them leave the motion along its normal free, "
            f"or leave the {element.kind} out"
        )
        hints.append(Hint(told + "; a joint rubs by a force of type friction" * bool(element.frictions), *element.path))
    changed = ", ".join(f"{name} by {shift:.6g}" for name, shift in state.start.shifts.items())
    for name, rope in system.constraints.items() if changed else ():
        if isinstance(rope, Rope) and rope.length is not None and not rope.slack:
            told = f"given start values were changed ({changed}): if they are right, rope {name} has another length; "
            hints.append(
                Hint(f"{told}without a length it is as long as they make it", "constraints", name, "length")
            )
    return hints


def _massless_hint(system: System, error: NoSolutionError) -> list[str]:
    """Return that a body is declared as a particle where its joint's freedom finds no inertia."""
    joint = system.joints.get(error.where.path[1]) if error.where.path[:1] == ("joints",) else None
    name = joint.child.partition(".")[0] if joint is not None else ""
    body = system.bodies.get(name)
    if body is None or body.mass is None or body.inertia is not None:
        return []
    told = f"body {name} has no inertia: it is a particle at its com, which does not resist turning about itself"
    return [Hint(f"{told}; give it one, such as inertia: {{Izz: m*l^2/12}}, or a shape", "bodies", name)]


def _mechanism_hints(resolved: Mechanism, begin: Start, states: Sequence[State]) -> list[str]:
    """Return what the mechanism and its start suggest was not meant."""
    state, base, hints = states[0], resolved.relative or resolved, list[str]()

    def at_start(name: str) -> Floats:
        return np.array(state.values([resolved.symbols[symbol(name)]]), dtype=float)

    gravity = np.array(state.values(resolved.gravity), dtype=float)
    grounds = [body for body in resolved.bodies if body.joint_name == GROUND]
    for body in grounds if gravity.any() else ():
        steps = [(s, g) for s, g in zip(body.steps, body.given, strict=True) if s.turns and g is not None]
        moves = any(given[1] is not ZERO for _, given in steps)
        axes = [np.array(state.values(axis), dtype=float) for step, _ in steps for axis in step.turns]
        if moves and any(np.abs(np.cross(axis, gravity)).max() > NEGLIGIBLE * np.abs(gravity).max() for axis in axes):
            hints = ["ground turns, and gravity does not turn with it: it keeps its direction among the stars, and "
                     "seen from ground it turns the other way"]
    hints += [
        f"body {name} has a negative mass: it counts as a hole, taken out of {of}"
        for name, of in holes(base, parameter_values(base, {}))
    ]
    hints += [
        f"joint {at.joint} starts beyond its {at.limit} limit, {at.bound:g} {at.unit}"
        for at in limits_passed(resolved, begin.parameters, at_start)
    ]
    if len(resolved.speeds) <= MANY_SPEEDS and len(states) <= _STATES:
        hints.append(
            "at most states near the start something declared has no value, the mass matrix is singular, "
            "or constraints contradict each other"
        )
    return [*hints, *slipped_wheels(resolved, begin.parameters)]


def _reaction_hints(
    resolved: Mechanism, multipliers: Mapping[str, float], not_unique: Sequence[str]
) -> Iterator[str]:
    """Yield ropes that would have to push at the start, and rolling wheels that their planes would have to pull."""
    for _, row in taut_ropes(resolved):
        if multipliers[row.name] < 0.0 and row.name not in not_unique:
            yield f"rope {row.name} would have to push with {-multipliers[row.name]:.6g} N at the start: it goes slack"
    largest = max(map(abs, multipliers.values()), default=0.0)
    for name in normal_forces(resolved):
        if multipliers[name] < -NEGLIGIBLE * largest and name not in not_unique:
            force = f"{force_name(name, 'multiplier')} is {multipliers[name]:.6g} N at the start"
            yield f"{force}: the plane would have to pull, and a real wheel lifts off"


def _structure_hints(system: System, resolved: Mechanism, rank: Redundancy) -> Iterator[str]:
    """Yield the degree of static indeterminacy, in the plane of a plane structure; then what is not compared."""
    if len(resolved.speeds) <= sum(rank.doubles.values()) + rank.rank:
        plane = in_plane(system)
        across = {row.name for row in resolved.rows if not row.acts_in_plane} if plane else set()
        rows = [row for row in rank.redundant if not (plane and row.rpartition(".")[2] in _OUT_OF_PLANE)]
        rows = [row for row in rows if row not in across]
        if rows:
            yield (
                f"statically indeterminate by {len(rows)}{' in the plane' if plane else ''}: equilibrium alone does "
                "not determine the reactions; they depend on how bodies deform, which is not computed"
            )
    slow = [name for name, route in ROUTES.items() if route.is_slow(resolved)]
    if slow:
        yield f"not compared, as it would take long for so many speeds: {', '.join(slow)}"
    if len(resolved.speeds) > MOST:
        yield "conserved quantities are not looked for, for the same reason"
    if len(resolved.speeds) > MANY_SPEEDS:
        yield "compared at the start only, for the same reason"


# --- the theorems in integral form along a short run -----------------------------------------------------------------
#
# State and integrals of the causes go on together by steps of order 8 in floats, without Programs, so that changes and
# impulses or work differ by rounding only; momentum or energy that a force leaves out adds up.

MANY: Final = 60
"""Speeds beyond which the short run would take seconds."""
_STEPS: Final = 2
_PART: Final = 0.02
"""The length of a step in parts of the shortest time of speeds and accelerations: of order 8, it is exact."""


def short_run_misses(mechanism: Mechanism, formalism: Formalism, state: State) -> dict[str, float]:
    """Return by how much impulse, angular impulse and work miss the changes along a short run from a state.

    Relative to the integrals of absolute values of all causes and of the changed quantities, which count by the second.
    A force that is left out misses by the same part in shorter runs, the method by less: the least miss is returned.
    Empty where something declared has no value soon after that state, where a force has a kink or jumps so soon that
    no shorter run ends before, where constraints depend on each other at that state but no more soon after, so that its
    accelerations do not last, and for more than `MANY` speeds.
    """
    least: dict[str, float] = {}
    if len(mechanism.speeds) > MANY:
        return least
    try:
        for part in (_PART, _PART / 30.0, _PART / 1000.0):
            found = _misses(mechanism, formalism, state, part)
            if found is not None:
                least = {name: min(least.get(name, math.inf), x) for name, x in found.items()}
                if max(least.values()) <= NEGLIGIBLE:
                    break
    except (*UNDEFINED, MultibodyError):
        return least
    return least


def _misses(mechanism: Mechanism, formalism: Formalism, state: State, part: float) -> dict[str, float] | None:
    """Return the misses of a run whose steps are a part of the shortest time; None where it comes over a kink.

    Raises NoSolutionError where other constraints are independent at its end than at its start.
    """
    run = _Run(mechanism, formalism, state)
    q, u, t = (np.array(x, dtype=float) for x in (state.q, state.u, state.slots[TIME]))
    rates = run.rates(float(t), q, u)
    fastest = max(float(np.abs(u).max(initial=0.0)), float(np.sqrt(np.abs(rates[1]).max(initial=0.0))))
    h = part / (1.0 + fastest)
    sides = run.sides(float(t), q, u)
    begin, adding, sizes = _values(run.motion(float(t), q, u)), np.zeros(7), np.zeros(7)
    for _ in range(_STEPS):
        q, u, adding, sizes = _step(run, float(t), h, (q, u, adding, sizes))
        t = t + h
        if (run.sides(float(t), q, u) != sides).any():
            return None
    if run.rank(float(t), q, u) != run.rank(float(state.slots[TIME]), *map(np.array, (state.q, state.u))):
        raise NoSolutionError("the motion begins in a singular position")
    end = run.motion(float(t), q, u)
    missed = np.abs(_values(end) - begin - adding)
    # Speeds of bodies at rest round to sqrt(eps) of p/m: p the impulse of absolute forces, m the mass of all bodies.
    mass = sum(abs(float(each.mass)) for each in end.masses)
    sizes[6] = max(sizes[6], EPSILON * float(sizes[:3].sum()) ** 2 / mass if mass else 0.0)
    found = {}
    for name, own in THEOREMS.items():
        size = float(sizes[own].max())
        found[INTEGRAL[name]] = 0.0 if not missed[own].any() else float(missed[own].max()) / size
    return found


_Integrated = tuple[Floats, Floats, Floats, Floats]


def _step(run: _Run, t: float, h: float, x: _Integrated) -> _Integrated:
    """Return q, u and the integrals of causes and sizes after a step of order 8."""
    method, slopes = dormand_prince_8(), list[_Integrated]()
    for row, c in zip(method.A[:-1], method.c, strict=False):
        at = _advance(x, slopes, [h * float(a) for a in row])
        slopes.append(run.rates(t + h * float(c), at[0], at[1]))
    last = [h * float(b) for b in method.A[-1]]  # the last stage is where the next step begins
    return _advance(x, slopes, last)


def _advance(x: _Integrated, slopes: list[_Integrated], weights: list[float]) -> _Integrated:
    q, u, adding, sizes = (
        part + sum((w * slope[k] for w, slope in zip(weights, slopes, strict=False)), np.zeros_like(part))
        for k, part in enumerate(x)
    )
    return q, u, adding, sizes


class _Run:
    """A mechanism's motion by a formalism, with the parameters of a state."""

    def __init__(self, mechanism: Mechanism, formalism: Formalism, state: State) -> None:
        self._mechanism, self._formalism = mechanism, formalism
        self._parameters = [state.slots[slot("parameters", k)] for k in range(len(mechanism.parameters))]

    def sides(self, t: float, q: Floats, u: Floats) -> Floats:
        """Return the signs of the switching functions of forces and motions (kinks)."""
        motion, kinks = self.motion(t, q, u), self._mechanism.kinks
        found = motion.state.values(kinks, quantities(motion, (), (), leaves(kinks, "quantity")))
        return np.asarray(np.sign(found), dtype=float)

    def motion(self, t: float, q: Floats, u: Floats) -> Motion:
        return motion_of(self._mechanism, self._state(t, q, u))

    def rank(self, t: float, q: Floats, u: Floats) -> int:
        """Return how many constraints are independent."""
        rows = self._formalism(self._mechanism, self._state(t, q, u)).rows
        return rank(constraint_jacobian(rows), SWITCHED) if rows else 0

    def rates(self, t: float, q: Floats, u: Floats) -> _Integrated:
        """Return qdot, udot, the causes of the changes of P, L and T, and the sizes (7) of all terms."""
        dynamics = self._formalism(self._mechanism, self._state(t, q, u))
        motion, found = self.motion(t, q, u), forward_dynamics(dynamics)
        acting = exertions(motion, found.udot.tolist(), dynamics.rows, found.multipliers.tolist())
        outside = [resultant(motion, each.of_body) for each in acting if each.from_outside]
        forces = np.array([[*force, *moment] for force, moment in outside], dtype=float).reshape(-1, 6)
        powers = np.array([each.power for each in acting], dtype=float)
        causes = np.append(forces.sum(axis=0), powers.sum())
        parts = [[*part.momentum, *angular_momentum([part])] for part in body_momenta(motion)]
        content = np.abs(np.array(parts, dtype=float).reshape(-1, 6)).sum(axis=0)
        size = np.append(np.abs(forces).sum(axis=0) + content, np.abs(powers).sum() + float(kinetic_energy(motion)))
        far = max((float(np.linalg.norm(np.array(p, dtype=float))) for _, p in motion.poses), default=0.0)
        size[3:6] += far * size[:3].sum()
        return np.array(dynamics.rates, dtype=float), found.udot, causes, size

    def _state(self, t: float, q: Floats, u: Floats) -> State:
        return state_of(self._mechanism, float, t, q.tolist(), u.tolist(), self._parameters)


def _values(motion: Motion) -> Floats:
    """Return P, L about the origin and T (7)."""
    parts = [[*part.momentum, *angular_momentum([part])] for part in body_momenta(motion)]
    found: Floats = np.append(np.array(parts, dtype=float).reshape(-1, 6).sum(axis=0), float(kinetic_energy(motion)))
    return found


# --- d'Alembert's principle in Lagrange's form, body by body in world axes, in floats: an independent reference ------
#
# The active and inertia forces of all bodies do no work on virtual displacements. Projected on the partial velocities
# J_C = dv_C/du and J_w = domega/du of each body:
#
#     M = sum m J_C^T J_C + J_w^T I J_w,   c = sum J_C^T m a_C + J_w^T (I alpha + omega x I omega)   (for udot = 0)
#
# Source: Wittenburg, Dynamics of Multibody Systems, section 5.2.


@dataclass(frozen=True)
class Reference:
    """M (n x n), Q (n), c (n), H (s x n), gamma (s), and the sums of absolute contributions to Q, c and gamma.

    Multipliers exert `forces` C^T lambda (C s x n), which is H but for friction, those of rows `beside` others along
    the vectors that they make with them, and are in rows that define forces by the `coupling` D (s x s). `exerted` (s):
    the largest force or moment that a unit multiplier exerts on a body, which need not be in H.
    """

    mass_matrix: Floats
    applied: Floats
    velocity_terms: Floats
    constraint_jacobian: Floats
    constraint_forcing: Floats
    absolute_applied: Floats
    absolute_velocity_terms: Floats
    absolute_constraint_forcing: Floats
    exerted: Floats
    forces: Floats
    coupling: Floats
    beside: Mapping[int, tuple[int, ...]]


@dataclass(frozen=True)
class Partials:
    """One body in world axes: rotation R_WB, partial velocities of its origin and of its rotation (3 x nu)."""

    rotation: Floats
    linear: Floats
    angular: Floats

    def force(self, force: Floats, moment: Floats) -> tuple[Floats, Floats]:
        """Return the generalised forces of a wrench about the origin (world axes), and their absolute contributions."""
        value = self.linear.T @ force + self.angular.T @ moment
        return value, self.sizes(float(np.linalg.norm(force)), float(np.linalg.norm(moment)))

    def sizes(self, force: float, moment: float) -> Floats:
        """Return the largest generalised forces of a force and a moment of these lengths.

        They are products of lengths, as terms may cancel in some axes and not in others.
        """
        found: Floats = np.linalg.norm(self.linear, axis=0) * force + np.linalg.norm(self.angular, axis=0) * moment
        return found


def dalembert(motion: Motion) -> Reference:
    """Return the equations of motion at a state over floats."""
    partials = partial_velocities(motion)
    count = len(motion.state.u)
    velocities, momenta = [np.zeros((0, count))], [np.zeros((0, count))]
    terms, absolute_terms = np.zeros(count), np.zeros(count)
    for index, (a, alpha) in enumerate(accelerations(motion, [0] * count)):
        mass, R = motion.masses[index], partials[index].rotation
        linear = partials[index].linear - _skew(R @ _array(mass.com)) @ partials[index].angular
        at_com, tensor = Partials(R, linear, partials[index].angular), R @ _array(mass.inertia) @ R.T
        velocities += [at_com.linear, at_com.angular]
        momenta += [float(mass.mass) * linear, tensor @ at_com.angular]
        (force, moment), sizes = _inertia_force(motion, R, tensor, index, a, alpha)
        terms += at_com.force(force, moment)[0]
        absolute_terms += at_com.sizes(*sizes)
    forces, absolute_forces = _generalized_loads(motion, partials)
    rows = row_motions(motion)
    jacobian = constraint_jacobian(rows).reshape(len(rows), count)
    gamma = np.array([row.gamma for row in rows], dtype=float)
    defining = [0.0 if row.kinematic else abs(float(row.gamma)) for row in rows]
    pushing = [row.forces if row.exerts is not None else h for row, h in zip(rows, jacobian, strict=True)]
    coupling = [[row.coupling.get(k, 0.0) for k in range(len(rows))] for row in rows]
    matrix = np.vstack(velocities).T @ np.vstack(momenta)
    absolutes = absolute_forces, absolute_terms, np.array(row_terms(motion), dtype=float) + defining
    square = (len(rows), len(rows))
    return Reference(
        matrix,
        forces,
        terms,
        jacobian,
        gamma,
        *absolutes,
        largest_wrenches(rows),
        np.array(pushing, dtype=float).reshape(jacobian.shape),
        np.array(coupling, dtype=float).reshape(square),
        {k: row.beside for k, row in enumerate(rows) if row.beside},
    )


def partial_velocities(motion: Motion) -> list[Partials]:
    """Return each body's partial velocities with respect to all speeds."""
    found: list[Partials] = []
    count = len(motion.state.u)
    world = Partials(np.eye(3), np.zeros((3, count)), np.zeros((3, count)))
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        parent = found[body.parent] if body.parent >= 0 else world
        rotation = _array(motion.rotation(index))
        linear = parent.linear - _skew(parent.rotation @ _array(moved.p_PB)) @ parent.angular
        angular = parent.angular.copy()
        for k, v, w in zip(body.u, moved.linear, moved.angular, strict=True):
            linear[:, k] += rotation @ _array(v)
            angular[:, k] += rotation @ _array(w)
        found.append(Partials(rotation, linear, angular))
    return found


def _inertia_force(
    motion: Motion, R: Floats, tensor: Floats, index: int, a: Sequence[float], alpha: Sequence[float]
) -> tuple[tuple[Floats, Floats], tuple[float, float]]:
    """Return m a_C and I alpha + omega x I omega in world axes, and the sums of the lengths of their terms.

    Of a ball omega x I omega is zero to the last bit here, and rounding where other routes add up its parts.
    """
    spin, turning, com = R @ _array(motion.bodies[index].w_WB), R @ _array(alpha), R @ _array(motion.masses[index].com)
    mass, momentum = float(motion.masses[index].mass), tensor @ spin
    a_com = R @ _array(a) + np.cross(turning, com) + np.cross(spin, np.cross(spin, com))
    w, arm = hypot(*spin), hypot(*com)
    force = mass * (hypot(*a) + (hypot(*turning) + w * w) * arm)
    moment = hypot(*(tensor @ turning)) + w * hypot(*momentum)
    return (mass * a_com, tensor @ turning + np.cross(spin, momentum)), (abs(force), moment)


def _generalized_loads(motion: Motion, partials: Sequence[Partials]) -> tuple[Floats, Floats]:
    """Return Q and its absolute contributions: each load's on each body, each weight, each drive."""
    total, absolute = np.zeros(len(motion.state.u)), np.zeros(len(motion.state.u))
    acting: list[tuple[AppliedForces, float, dict[int, float]]] = []
    for load in motion.mechanism.loads:
        # where a load has no moment about a body's origin, that is a difference of terms as long as its distance
        levers: dict[int, float] = {}
        for marker in load.points:
            distance = hypot(*pose(motion.state, marker.pose)[1])
            levers[marker.body] = max(levers.get(marker.body, 0.0), distance)
        acting.append((applied_forces(motion, [load], weight=False), _cancellation(motion, load), levers))
    for forces, larger, levers in (*acting, (applied_forces(motion, []), 1.0, {})):
        drives = np.array(forces.of_speed, dtype=float)
        total, absolute = total + drives, absolute + larger * np.abs(drives)
        acted_on = [k for k, wrench in enumerate(forces.of_body) if wrench != NO_WRENCH]
        for k, body in ((k, partials[k]) for k in acted_on):
            force, moment = (body.rotation @ _array(x) for x in forces.of_body[k])
            pressed = float(np.linalg.norm(force))
            part = body.sizes(pressed, max(float(np.linalg.norm(moment)), levers.get(k, 0.0) * pressed))
            total, absolute = total + body.force(force, moment)[0], absolute + larger * part
    return total, absolute


def _cancellation(motion: Motion, load: Load) -> float:
    """Return by which factor the terms of a spring's force are larger than the force, which is their difference."""
    if load.spring is None:
        return 1.0
    if isinstance(load, JointSpring):
        k, d, rest = motion.state.values([load.stiffness, load.damping, load.rest])
        at, rate = motion.state.values([load.coordinate, load.rate])
        terms, force = abs(k) * (abs(at) + abs(rest)) + abs(d * rate), k * (at - rest) + d * rate
    elif isinstance(load, PointSpring):
        k, d, rest = motion.state.values([load.stiffness, load.damping, load.length])
        if not any(apart(motion, load.ends)):
            return 1.0  # a spring without rest length, whose ends meet
        length, direction = span(motion, load.ends)
        first, second = (np.array(velocity(motion, end), dtype=float) for end in load.ends)
        terms = abs(k) * (length + abs(rest)) + abs(d) * float(np.linalg.norm(first) + np.linalg.norm(second))
        force = k * (length - rest) + d * float(np.dot(direction, second - first))
    else:
        raise TypeError(f"nothing says of which terms the force of {type(load).__name__} is a difference")
    return float(terms / abs(force)) if force else 1.0


def _array(vector: object) -> Floats:
    return np.array(vector, dtype=float)


def _skew(a: Floats) -> Floats:
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


# --- agreement: residuals of one route's accelerations and multipliers in the equations of motion of another ---------
#
# Residuals are compared, not accelerations: on long chains of thin rods two good routes differ in udot by 1e-5.


LARGEST_ON_TREES: Final = 10.0
LARGEST_WITH_ROWS: Final = 100.0
"""Ratios up to these are rounding; wrong equations give 1e10 and more."""


def compare_formalisms(
    mechanism: Mechanism, states: Sequence[State], formalisms: Mapping[str, Formalism]
) -> dict[str, float]:
    """Return each formalism's worst ratio over states with floats, measured with d'Alembert's principle."""
    worst = dict.fromkeys(formalisms, 0.0)
    for state in counted(states, "state"):
        reference = dalembert(motion_of(mechanism, state))
        for name, formalism in formalisms.items():
            found = forward_dynamics(formalism(mechanism, state))
            here = ratio(reference, found.udot, found.multipliers)
            worst[name] = float(np.maximum(worst[name], here))  # which keeps nan
    return worst


def beyond_rounding(mechanism: Mechanism, ratios: Mapping[str, float]) -> list[str]:
    """Return the formalisms whose ratios are more than rounding, or no numbers."""
    largest = LARGEST_WITH_ROWS if mechanism.rows else LARGEST_ON_TREES
    return [name for name, value in ratios.items() if not value <= largest]


def ratio(reference: Reference, udot: Sequence[float] | Floats, multipliers: Sequence[float] | Floats) -> float:
    """Return the largest scaled residual of udot (n) and lambda (s) in a reference's equations of motion.

    With D = diag(M)^(-1/2) and r = M udot - (Q - c) - H^T lambda, where friction puts other forces in place of H^T
    lambda, and rows that define forces have their terms with lambda beside H udot:

        |D r| / (eps n (|D M D| |udot / D| + |D Q| + |D c| + |D H^T| |lambda|)),   norms: largest row sums,

    where |Q|, |c|, |gamma_j| are sums of absolute contributions; and for each row

        |H_j udot - gamma_j| / (eps n (|H_j D|_1 |udot / D| + |H_j| |v| + |gamma_j|)),

    where |v| is the largest that terms of one row's gamma make of udot: D^2 H_k^T |gamma_k| / |H_k D|^2.
    A row H_j that is zero but for rounding counts as long as the longest, or as what it exerts. 0/0 is 0; nan is
    returned where anything is not finite. In equilibrium udot is what the forces round to: it counts as sqrt(eps) of
    them at least.
    """
    x, multiplier = np.asarray(udot, dtype=float), np.asarray(multipliers, dtype=float)
    matrix, jacobian, exerted = reference.mass_matrix, reference.constraint_jacobian, reference.forces
    if reference.beside:
        exerted = np.array(along_reactions(exerted.tolist(), reference.beside, multiplier.tolist()), dtype=float)
    # the inertia of a freedom without mass is that by which the rows that hold it make it resist
    diagonal = matrix.diagonal()
    by_rows = (diagonal.max(initial=0.0) or 1.0) * np.square(jacobian).sum(axis=0)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, by_rows))
    residual = matrix @ x - (reference.applied - reference.velocity_terms) - exerted.T @ multiplier
    forces = _norm(scale * reference.absolute_applied) + _norm(scale * reference.absolute_velocity_terms)
    forces += _row_norm(scale[:, None] * exerted.T) * _norm(multiplier)
    size = _norm(x / scale)
    inertia = _row_norm(scale[:, None] * matrix * scale) or 1.0  # without any mass rows alone resist, with 1 kg
    ratios = [_relative_size(_norm(scale * residual), inertia * size + forces)]
    sizes = np.abs(jacobian * scale).sum(axis=1)
    natural = np.maximum(reference.exerted * scale.max(initial=0.0), sizes.max(initial=0.0))
    sizes = np.where(sizes <= ROUNDING * natural, natural, sizes)
    # the largest udot (n) that terms of one row's gamma demand alone, which bounds its rounding
    weighted = np.abs(jacobian) * scale * scale
    squares = (weighted * np.abs(jacobian)).sum(axis=1)
    there = squares > ROUNDING**2 * squares.max(initial=0.0)
    demanded = np.divide(reference.absolute_constraint_forcing, squares, out=np.zeros(len(squares)), where=there)
    rounded = (weighted * demanded[:, None]).max(axis=0, initial=0.0)
    terms = reference.absolute_constraint_forcing + np.abs(jacobian) @ rounded
    least = max(size, math.sqrt(EPSILON) * forces)
    defined = reference.coupling @ multiplier
    terms = terms + np.abs(reference.coupling) @ np.abs(multiplier)
    missed = np.abs(jacobian @ x + defined - reference.constraint_forcing)
    ratios += map(_relative_size, missed.tolist(), (sizes * least + terms).tolist())
    return float(np.max(ratios)) / (EPSILON * max(len(x), 1))


def _norm(x: Floats) -> float:
    return float(np.abs(x).max(initial=0.0))


def _row_norm(matrix: Floats) -> float:
    return _norm(np.abs(matrix).sum(axis=1))


def _relative_size(residual: float, size: float) -> float:
    return 0.0 if residual == 0.0 else residual / size if size else np.inf
