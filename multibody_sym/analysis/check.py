"""`check`: whether a system is what its author means, and whether all routes to its equations agree.

In: a System. Out: a CheckReport with degrees of freedom, redundancy, residuals, conserved quantities and hints.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.hints import Hint, declared_hints, first_at_each_place
from multibody_sym.analysis.independent_checks import beyond_rounding, compare_formalisms, short_run_misses
from multibody_sym.contact_laws.problem import Verdict
from multibody_sym.derivation.routes import FORMALISMS, MANY_SPEEDS, ROUTES, formalism_name
from multibody_sym.dynamics.balance import NEGLIGIBLE, terms_at_states, theorems
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.conserved import MOST, find_conserved
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.dynamics.redundancy import contradiction_of, redundancy
from multibody_sym.dynamics.start.declared_impact import from_impact
from multibody_sym.dynamics.start.initial_geometry import slipped_wheels
from multibody_sym.dynamics.start.number_checks import blame_numbers, check_numbers, end_of_run, holes, on_numbers
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start, sampled_states, verify_regular_start
from multibody_sym.dynamics.start.state import StartState, state_at
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.declared_rows import with_driving_inputs
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.mechanism import TIME, Mechanism, normal_forces
from multibody_sym.mechanics.modes import taut_ropes
from multibody_sym.mechanics.motion import State, motion_of
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.constraints import Rope
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.system import System
from multibody_sym.motion.results.limits_passed import limits_passed
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, symbol
from multibody_sym.scalars.sign_changes import switching_functions
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

    `parameters` .. `project`: what the call changes of the system (`Overrides`); `formalism`: that whose motion and
    forces theorems and hints are about, None for the cheapest; all that apply are compared.
    Raises InputError for what the declaration contradicts.
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
    ratios = compare_formalisms(resolved, states, compared)
    solved = [forward_dynamics(formalism(resolved, state)) for state in states]
    residuals = theorems(terms_at_states(resolved, states, solved)) | short_run_misses(resolved, formalism, states[-1])
    if not all(map(math.isfinite, (*ratios.values(), *residuals.values()))):
        blame_numbers(system)
    masses = (x for body in resolved.bodies for x in (body.mass.mass, *body.mass.inertia))
    if all(x is ZERO for x in masses) and not resolved.loads:
        residuals = {}  # all forces are zero but for rounding: the theorems say that 0 is 0
    missed = [f"theorem of {name.replace('_', ' ')}" for name, x in residuals.items() if not x <= NEGLIGIBLE]
    missing = (*beyond_rounding(resolved, ratios), *missed)
    multipliers = dict(zip((row.name for row in resolved.rows), solved[0].multipliers.tolist(), strict=True))
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
            yield Hint(told, "contacts", declared)
        elif kind == "rod":
            told = (
                f"the side of {other} does not touch the edges of {box} in contact {name}, its ends touch the faces: "
                f"where they may cross, declare a contact of both, such as between: [{other}.side, {box}.top_front]"
            )
            yield Hint(told, "contacts", declared)
        elif kind in ("disc", "cylinder"):
            told = (
                f"rims of {other} touch the faces of {box} in contact {name}, nothing of it the edges and corners: it "
                "passes through these"
            )
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
        rows = [row for row in rank.redundant if not (plane and row.rpartition(".")[2] in _OUT_OF_PLANE)]
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
