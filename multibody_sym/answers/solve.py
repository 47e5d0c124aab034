"""`solve`: accelerations, tensions and reactions at the given instant, in numbers and in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from multibody_sym.algebra.roots import values_with_shared_roots
from multibody_sym.answers.instant.instant import (
    SolvedInstant,
    is_lettered,
    place_of,
    reactions_of,
    solved_start,
    unique_sums,
    with_letters,
)
from multibody_sym.answers.instant.letters import acceleration_names
from multibody_sym.answers.instant.states import beyond_limits, left_out, state_found, validity
from multibody_sym.answers.records import OtherState, RowKind, Solution
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.initial_geometry import slipped_wheels
from multibody_sym.dynamics.start.number_checks import numbers_of
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.mechanism import Coordinate, Speed
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import flag
from multibody_sym.model.system import System, angles_of
from multibody_sym.scalars.node import as_node, symbol
from multibody_sym.stages import stage
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

if TYPE_CHECKING:
    from multibody_sym.answers.ask.ask import Answers
    from multibody_sym.answers.ask.working import WorkedAnswer


def solve(
    system: System,
    parameters: Mapping[str, Any] | None = None,
    formalism: str | None = None,
    *,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    steps: bool = False,
) -> Solution:
    """Return accelerations, forces and states at t = 0, or the result of the impact that the system declares.

    Of a system with stages (`then`) the solution is that of the first; the others are its `stages`.
    `parameters` to `project` change the system for this call. `formalism` selects the route to the numbers. With
    `steps` the solution has the derivation of a book (`Solution.steps`).
    Numbers come from M udot = f + H^T lambda, H udot = gamma in floats, closed forms from the same equations over exact
    quotients. A closed form must equal the number (to 1e-9) and be short enough to read.
    Raises InputError, NoSolutionError (no start, no inertia, contradicting constraints).
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    with numbers_of(changed):
        if not changed.then:
            return _solution(changed, formalism, steps=flag("steps", steps))
        from multibody_sym.answers.stages import solution_in_stages  # which few systems have

        return solution_in_stages(changed, partial(_solution, formalism=formalism, steps=flag("steps", steps)))


def _solution(system: System, formalism: str | None, *, steps: bool) -> Solution:
    """Return the solution of a system without stages, at its start or of its impact."""
    if system.impact is not None:
        return solution_of_impact(system, formalism, steps=steps)
    solved = _solved(system, formalism)
    found, asked = solution_of(solved)
    if not steps:
        return found
    from multibody_sym.answers.worked.worked import worked_steps

    with stage("steps"):
        return replace(found, steps=worked_steps(solved, found, asked))


def _solved(system: System, formalism: str | None) -> SolvedInstant:
    """Return the solved start, in the state of exact numbers where floats cannot tell it."""
    solved = solved_start(system, formalism)
    beyond = beyond_limits(solved)
    return solved_start(system, formalism, beyond) if beyond else solved


def solution_of_impact(system: System, formalism: str | None, *, steps: bool = False) -> Solution:
    """Return what the impact of a system does; accelerations and reactions belong to before or after it.

    Questions about the motion after it are answered for the system that starts with the speeds then.
    """
    from multibody_sym.answers.impact import answers_after, impact_found, system_after  # which few systems need

    found, solved, blows = impact_found(system, formalism)
    answers, remarks = answers_after(solved), list[str]()
    at_impact, later = list(answers), None
    if len(answers) < len(system.ask):
        from multibody_sym.answers.ask.ask import answers_of

        later = _solved(system_after(solved, found, answers), formalism)
        about_motion = answers_of(later)
        remarks = about_motion.remarks
        known, worked = {**answers, **about_motion.values}, about_motion.worked
        parts = {name: worked[name].parts if name in worked else ("",) for name in system.ask}
        keys = (f"{name}{end}" for name, ends in parts.items() for end in ends)
        answers = {key: known.get(key, Value(None)) for key in keys}
    values = [*found.values, *answers.values()]
    shared = iter(values_with_shared_roots(values, solved.symbolic.letters))
    found, answers = found.with_values(islice(shared, len(found.values))), dict(zip(answers, shared, strict=True))
    worked_out = None
    if steps:
        from multibody_sym.answers.ask.working import WorkedAnswer, Working
        from multibody_sym.answers.impact_solution import worked_impact
        from multibody_sym.answers.worked.questions import with_questions
        from multibody_sym.answers.worked.worked import worked_steps
        from multibody_sym.derivation.notation import symbols_of

        worked_out = worked_impact(solved, found, blows)
        own = ((name, system.ask[name].value) for name in at_impact)
        asked = {name: WorkedAnswer(text(x), Working(), x) for name, x in own if x is not None}
        worked_out = with_questions(worked_out, solved.mechanism, symbols_of(solved.mechanism), answers, asked)
        if later is not None:
            moved = replace(solution_of(later, about_motion)[0], answers=answers)
            worked_out = worked_out.followed_by(worked_steps(later, moved, about_motion.worked))
    mechanism, begin = solved.mechanism, solved.begin
    return Solution(
        name=mechanism.name,
        coordinates=dict(zip((c.name for c in mechanism.coordinates), begin.q, strict=True)),
        speeds=dict(zip((s.name for s in mechanism.speeds), begin.u, strict=True)),
        accelerations={},
        reactions={},
        conditions=(*found.conditions, *remarks),
        answers=answers,
        notes=found.notes,
        limits=found.limits,
        shifts=dict(begin.shifts),
        withheld={name: each.components for name, each in mechanism.withheld.items()},
        withheld_reasons=tuple(reasons(mechanism.withheld)),
        units=MechanismUnits(mechanism).state,
        impact=found,
        steps=worked_out,
        angles=angles_of(system),
    )


def solution_of(solved: SolvedInstant, answered: Answers | None = None) -> tuple[Solution, Mapping[str, WorkedAnswer]]:
    """Return what holds at a start that was solved, and how the answers to questions are found, or were `answered`."""
    resolved, begin = solved.mechanism, solved.begin
    names, measures = acceleration_names(resolved), MechanismUnits(resolved)
    units = {name: measures.accelerations[speed.name] for name, speed in zip(names, resolved.speeds, strict=True)}
    with stage("accelerations"):
        accelerations = with_letters(solved, lambda instant: dict(zip(names, instant.udot, strict=True)), units)
    reactions = {} if solved.needs_no_forces else reactions_of(solved)
    withheld = {} if solved.needs_no_forces else resolved.withheld
    answers, remarks, asked = answered or _answers(solved)
    valid, state = validity(solved, reactions), state_found(solved)
    places = {place_of(row)[0]: row for row in resolved.rows}
    kinds: dict[str, RowKind] = {name: row.multiplier for name, row in places.items() if name in reactions}
    for element in resolved.one_way:
        own = element.name if element.kind == "stop" else element.group  # a stop's group is its joint
        kinds |= {name: element.kind for name in (own, element.name) if name in reactions}
    notes = [*slipped_wheels(resolved, begin.parameters), *left_out(solved)]
    if solved.beyond:
        notes.append(f"forces that are not unique have no value: in those of least norm {solved.beyond}")
    notes += [f"numbers only, where no closed form is given: {reason}" for reason in solved.reasons]
    found = Solution(
        name=resolved.name,
        coordinates=dict(zip((c.name for c in resolved.coordinates), begin.q, strict=True)),
        speeds=dict(zip((s.name for s in resolved.speeds), begin.u, strict=True)),
        accelerations=accelerations,
        rates=_rates_of_states(solved),
        reactions=reactions,
        kinds=kinds,
        conditions=(*valid.conditions, *remarks),
        answers=answers,
        notes=tuple(notes),
        assembled=_assembled_values(solved),
        shifts=dict(begin.shifts),
        withheld={name: each.components for name, each in withheld.items()},
        withheld_reasons=tuple(reasons(withheld)),
        units=measures.state,
        states=state.words,
        closing=state.closing,
        directions=state.directions,
        found=state.lines,
        limits={condition: broken for condition, broken in valid.conditions.items() if broken},
        at_limit=state.at_limit,
        needed=state.needed,
        sums=unique_sums(solved, reactions),
        others=tuple(
            OtherState(
                mode_words(resolved.one_way, mode),
                {name: x.value or 0.0 for name, x in zip(names, udot, strict=True)},
                {name: x.error for name, x in zip(names, udot, strict=True)},
            )
            for mode, udot in solved.decided.others
        ),
        at_rest=solved.is_structure,
        verdict=solved.decided.verdict,
        searched=solved.decided.searched,
        labels=letters_of(solved.system),
        angles=angles_of(solved.system),
    )
    return _with_shared_roots(solved, found), asked


def _answers(solved: SolvedInstant) -> tuple[Mapping[str, Value], list[str], Mapping[str, WorkedAnswer]]:
    """Return the answers to the questions of a system, remarks on them, and how each is found."""
    if not solved.system.ask:
        return {}, [], {}
    from multibody_sym.answers.ask.ask import answers_of  # which brings runs and all that they take

    return answers_of(solved)


def _rates_of_states(solved: SolvedInstant) -> dict[str, Value]:
    mechanism = solved.mechanism
    names = [c.name for c in mechanism.coordinates if c.rate is not None]

    def rates(instant: StateQuantities) -> dict[str, Any]:
        return dict(zip(names, instant.motion.state.values(mechanism.rates), strict=True))

    return with_letters(solved, rates, mechanism.rate_units) if names else {}


def _with_shared_roots(solved: SolvedInstant, found: Solution) -> Solution:
    """Return a solution with one form of each root in all that it gives formulas for."""
    every = [found.answers, found.accelerations, *found.reactions.values(), found.assembled]
    shared = iter(values_with_shared_roots([x for part in every for x in part.values()], solved.symbolic.letters))
    answers, accelerations, *reactions, assembled = [{name: next(shared) for name in part} for part in every]
    values = (*answers.values(), *accelerations.values(), *(x for part in reactions for x in part.values()))
    every_value = (*values, *assembled.values())
    forms = [x.expression for x in every_value if x.expression is not None and is_lettered(solved, x)]
    letters = solved.lettered.found if forms else None
    return replace(
        found,
        where={} if letters is None else {str(node.data): one for node, one in letters.needed(forms).items()},
        answers=answers,
        accelerations=accelerations,
        reactions=dict(zip(found.reactions, reactions, strict=True)),
        assembled=assembled,
    )


def _assembled_values(solved: SolvedInstant) -> dict[str, Value]:
    """Return the start values that constraints determined, but for given ones that were right and speeds that vanish.

    Those that formulas name have no expression of their own.
    """
    found: dict[str, Value] = {}
    begin, state = solved.begin, solved.symbolic.state
    declared: list[Coordinate | Speed] = [*solved.mechanism.coordinates, *solved.mechanism.speeds]
    pairs = zip(declared, (*state.q, *state.u), (*begin.q, *begin.u), strict=True)
    for each, node, number in pairs:
        letter = as_node(node) is symbol(each.name)
        if each.name in begin.assembled and (letter or each.name in begin.shifts or not (each.given or number == 0.0)):
            closing = solved.symbolic.closings.get(symbol(each.name))
            value = Value(number, closing) if letter else solved.value(as_node(node), number)
            letters = solved.lettered.found if value.expression is None and value.value else None
            known = None if letters is None else letters.definitions.get(symbol(each.name))
            if known is not None and known.expression is not None:
                value = replace(value, expression=known.expression)
            found[each.name] = replace(value, unit=each.unit)
    return found
