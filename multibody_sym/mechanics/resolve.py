"""Which Mechanism follows from a System: references, names, tree order, slots? A pure function; errors have paths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.changes import end_questions, in_stage, stage_systems
from multibody_sym.mechanics.declared_rows import (
    cut_joints,
    declared_rows,
    driving_inputs,
    expression_of,
    stops,
    with_constants,
    with_driving_inputs,
    with_named_outputs,
)
from multibody_sym.mechanics.forces import loads, with_own_names
from multibody_sym.mechanics.law_elements import LawElement, StruckImpacts
from multibody_sym.mechanics.mechanism import (
    TIME,
    Coordinate,
    JointLimit,
    Mechanism,
    ParameterEntry,
    ParameterVector,
    Speed,
    TreeBody,
    double_name,
)
from multibody_sym.mechanics.modes import possible_words
from multibody_sym.mechanics.references import BARE, References
from multibody_sym.mechanics.row_records import CutJoint, Row
from multibody_sym.mechanics.spanning_tree import (
    SpanningTree,
    body_part,
    coordinate_names,
    ground_moves,
    has_rows,
    rate_names,
    spanning_tree,
    speed_names,
    used_joints,
)
from multibody_sym.mechanics.vocabulary import (
    Dimensions,
    meanings,
    verify_curves,
    verify_expressions,
    verify_forces,
    verify_questions,
)
from multibody_sym.model.bodies import GROUND, IDENTITY, NO_MASS, Pose, mass_of, unit_vector, used_up
from multibody_sym.model.constraints import OnCurve, Rolling
from multibody_sym.model.fields import Names
from multibody_sym.model.joints import Foot, Initial, Joint, MovingJoint
from multibody_sym.model.parameters import Tabled, input_dimensions
from multibody_sym.model.state_words import StateCondition, state_conditions
from multibody_sym.model.steps import PARAMETER, Rotate, Translate
from multibody_sym.model.system import System, expressions_in, verify_system, with_expressions
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import ZERO, Node, as_node, named_nodes, negate, quantity, slot, symbol
from multibody_sym.scalars.sign_changes import fading_functions, switching_function, switching_functions
from multibody_sym.text.parser import of_run

if TYPE_CHECKING:  # joints in absolute coordinates are seldom asked for
    from multibody_sym.mechanics.absolute import Freed

# ----------------------------------------------------------------------------------------------------------------------
# The bodies of the tree with the joints that carry them, a moving ground first.


def _tree_bodies(references: References, carrying: Iterable[str], doubled: Iterable[str]) -> tuple[TreeBody, ...]:
    """Return the bodies in tree order, then the massless doubles that cut joints carry, named by their joints."""
    system = references.system
    carried = [(name, body_part(system.joints[name].child, system.bodies)[0]) for name in carrying]
    wanted = [(name, child, mass_of(system.bodies[child]), False) for name, child in carried]
    wanted += [(name, double_name(system.joints[name].child, name), NO_MASS, True) for name in doubled]
    made, q, u = [], 0, 0
    for joint_name, name, mass, double in wanted:
        joint, (on_parent, on_body) = system.joints[joint_name], references.frames(joint_name)
        steps = tuple(step.with_directions(unit_vector) for step in joint.moves)
        nq, nu = len(joint.coordinate_units), len(joint.speed_units)
        numbers = tuple(range(q, q + nq)), tuple(range(u, u + nu))
        ends = on_parent.pose, on_body.pose
        foot = isinstance(joint, Foot)
        made.append(TreeBody(name, on_parent.body, joint_name, steps, *ends, mass, *numbers, double, foot))
        q, u = q + nq, u + nu
    return (*_moving_ground(references), *made)


def _moving_ground(references: References) -> tuple[TreeBody, ...]:
    """Return a ground that moves as a body on prescribed steps."""
    body = references.system.bodies.get(GROUND, BARE)
    if body.motion is None:
        return ()
    if GROUND in references.system.joints:
        raise ModelError(
            "ground moves, and its own drive is called 'ground'; give the joint another name", number="M108"
        ).under(
            "joints"
        )
    places = zip(IDENTITY, (body.motion.x, body.motion.y, body.motion.z), strict=True)
    moves = [Translate(axis, motion=place) for axis, place in places if place is not ZERO]
    turns = [Rotate(unit_vector(turn.axis), motion=turn.angle) for turn in body.motion.turn]
    return (TreeBody(GROUND, -1, GROUND, (*moves, *turns), Pose(), Pose(), mass_of(body), (), ()),)


# ----------------------------------------------------------------------------------------------------------------------
# The elements with laws, in their order in all results.

def _has_surfaces(system: System) -> bool:
    """Return whether surfaces touch or roll, or a curve guides a point."""
    guided = (isinstance(element, (Rolling, OnCurve)) for element in system.constraints.values())
    return bool(system.contacts) or any(guided)


def _law_elements(references: References, declared: Sequence[LawElement]) -> tuple[LawElement, ...]:
    """Return all elements with laws; `declared` are those of constraints."""
    found: list[LawElement] = []
    if _has_surfaces(references.system):
        from multibody_sym.mechanics.contacts import contacts

        found += contacts(references)
    found += [*declared, *stops(references)]
    if references.system.frictions:
        from multibody_sym.mechanics.joint_friction import joint_frictions

        found += joint_frictions(references)
    smooth = references.system.simulation.friction
    if smooth is None:
        return tuple(found)
    for k, element in enumerate(found):
        parts = list(element.frictions)
        for i, part in enumerate(parts):
            if not part.enough and part.regularised is None:  # it may slip, and has no smooth friction of its own
                parts[i] = replace(part, regularised=smooth.regularised / part.arm)
        found[k] = replace(element, frictions=tuple(parts))
    return tuple(found)


# ----------------------------------------------------------------------------------------------------------------------
# The order of work.


def mechanism(system: System) -> Mechanism:
    """Return the mechanism that a system declares, of several stages that of the first.

    Raises ModelError (with the path of the field) for unknown names, wrong dimensions, bodies that nothing joins, and
    whatever else contradicts itself.
    """
    verify_system(system)
    if system.then:
        return _first_of_stages(system)
    if _has_surfaces(system):
        from multibody_sym.mechanics.contacts import with_feet  # which few systems need

        system = with_feet(system)
    relative = _with_withheld(_resolve(system), system)
    verify_questions(system, relative)
    if system.simulation.coordinates == "relative":
        return relative
    from multibody_sym.mechanics.absolute import freed_bodies

    freed = freed_bodies(system, [body.joint_name for body in relative.bodies])
    return _with_withheld(replace(_resolve(freed.system, freed), relative=relative), system)


def _first_of_stages(system: System) -> Mechanism:
    """Return the mechanism of the first stage of a system; those of all stages are verified."""
    found, earlier = list[Mechanism](), dict[Node, Node]()
    for number, part in enumerate(stage_systems(system), 1):
        with in_stage(system, number):
            own = {name: with_expressions(x, lambda node: substitute(node, earlier)) for name, x in part.ask.items()}
            ends = end_questions(system, number) if number <= len(system.then) else {}
            found.append(mechanism(replace(part, ask=Names({**own, **ends}))))
        earlier.update(dict.fromkeys(map(symbol, part.ask), as_node(1)))
    first = found[0].relative or found[0]
    names = [each.name for group in (first.coordinates, first.speeds) for each in group]
    for k, stage in enumerate(system.then):
        for name in stage.initial or {}:
            if name not in names:
                with at("then", str(k), "initial", name):
                    raise ModelError(
                        f"no coordinate or speed is called {name!r}", number="M117", word=name, known=names
                    )
    return found[0]


def _with_withheld(resolved: Mechanism, system: System) -> Mechanism:
    if all(row.expression is None for row in (resolved.relative or resolved).rows):
        return resolved
    from multibody_sym.mechanics.gears import with_withheld  # which expressions as constraints need

    return with_withheld(resolved, system)


def _resolve(system: System, freed: Freed | None = None) -> Mechanism:
    """Return a system's mechanism; with bodies `freed` coordinates of cut joints are measured as far as poses tell."""
    tree = spanning_tree(system)
    doubled, measuring = _uncarried_joints(system, tree, freed)
    named = (*tree.carrying, *doubled)
    coordinates, speeds = (*_coordinates(system, named), *_states(system)), _speeds(system, named)
    names = meanings(system, (*coordinates, *_coordinates(system, measuring)), (*speeds, *_speeds(system, measuring)))
    slots = _slots(system, coordinates, speeds)
    references = _references(system, tree, doubled, names, slots, plane=bool(freed and freed.plane))
    bodies = _tree_bodies(references, tree.carrying, doubled)
    told: Mapping[Node, Node] = {}
    if measuring:
        from multibody_sym.mechanics.absolute import relative_coordinates

        told = relative_coordinates(references, bodies[: len(bodies) - len(doubled)], measuring)
    references = with_constants(replace(references, measured=told), bodies)
    rows, loose = declared_rows(references)
    cuts = cut_joints(references, [name for name in tree.cut if name not in doubled], rows)
    resolved = _in_slots(told, references.system)
    one_way = _in_slots(told, _law_elements(references, loose))
    loaded = _in_slots(told, tuple(loads(references)))
    state_stops = _state_stops(resolved, one_way)
    struck = _in_slots(told, _impacts(references, one_way, rows, cuts))
    with_forces = [*one_way, *(() if struck is None else struck.meetings)]
    verify_forces(system, with_forces, [row.name for row in rows if row.name.rpartition(".")[0] in tree.cut])
    adding = {name: node for name, node in resolved.outputs.items() if of_run(node)}
    others = {name: node for name, node in resolved.outputs.items() if name not in adding}
    rates = {name: state.rate for name, state in resolved.states.items()}
    laws = _declared_laws(resolved, slots)
    tables = [expression_of(name, x) for name, x in resolved.inputs.items() if isinstance(x, Tabled)]
    return Mechanism(
        name=system.name,
        gravity=resolved.gravity,
        bodies=_in_slots(told, bodies),
        markers=references.markers(),
        coordinates=tuple(
            replace(c, initial=substitute(c.initial, slots), rate=rates.get(c.name)) for c in coordinates
        ),
        speeds=tuple(replace(s, initial=substitute(s.initial, slots)) for s in speeds),
        parameters=references.parameters.with_rows(len(rows)),
        inputs={name: expression_of(name, x) for name, x in resolved.inputs.items()},
        outputs={**{name.data: node for name, node in told.items()}, **others},
        run_outputs=adding,
        stops=_stops(resolved, _in_slots(told, bodies), [*rows, *(element.normals[0] for element in loose)]),
        kinks=tuple(filter(_changes, switching_functions([*laws, *tables]))),
        fades=tuple(filter(_changes, fading_functions(laws))),
        loads=loaded,
        rows=_in_slots(told, tuple(rows)),
        limits=tuple(_joint_limits(resolved, {**slots, **told})),
        cuts=_in_slots(told, tuple(cuts)),
        symbols={**_rates(told, rate_names(system)), **slots, **told},
        driving_inputs=driving_inputs(system),
        input_dimensions=input_dimensions(system.inputs),
        minimum_norm=system.simulation.multipliers == "minimum_norm",
        one_way=one_way,
        state_stops=state_stops,
        impact=struck,
    )


def _impacts(
    references: References, one_way: Sequence[LawElement], rows: Sequence[Row], cuts: Sequence[CutJoint]
) -> StruckImpacts | None:
    if references.system.impact is None:
        return None
    from multibody_sym.mechanics.impacts import struck_impacts  # which few systems have

    return struck_impacts(references, one_way, rows, cuts)


def _uncarried_joints(system: System, tree: SpanningTree, freed: Freed | None) -> tuple[list[str], list[str]]:
    """Return the cut joints that carry a double of their child, and those whose coordinates are measured.

    A joint carries a massless double, which rows hold to the child itself, where its coordinates are used or no rows
    can stand for it.
    """
    if freed is None:
        used = used_joints(system) if tree.cut else set()
        return [name for name in tree.cut if name in used or not has_rows(system.joints[name])], []
    return [x for x in tree.cut if x in freed.doubled], [x for x in tree.cut if x in freed.measured]


def _references(
    system: System,
    tree: SpanningTree,
    doubled: Sequence[str],
    names: Mapping[str, str],
    slots: Mapping[Node, Node],
    *,
    plane: bool,
) -> References:
    """Return the references of a system whose expressions are verified, and written in slots."""
    spanned = with_own_names(system, names)
    verify_expressions(spanned, names)
    verify_curves(spanned, names)
    carried = [body_part(system.joints[name].child, system.bodies)[0] for name in tree.carrying]
    first = 0 if ground_moves(system.bodies) else -1  # a moving ground is the first body of the tree
    numbers = {name: number for number, name in enumerate([GROUND, *carried], first)}
    entries = (
        ParameterEntry(name, substitute(parameter.value, slots), parameter.positive, dimension=parameter.dimension)
        for name, parameter in system.parameters.items()
    )
    return References(
        _in_slots(slots, with_named_outputs(with_driving_inputs(spanned), names)),
        numbers,
        slots,
        ParameterVector(tuple(entries)),
        plane,
        carrying=frozenset(tree.carrying),
        doubles={name: number for number, name in enumerate(doubled, max(numbers.values()) + 1)},
    )


def _changes(node: Node) -> bool:
    """Return whether an expression depends on more than parameters."""
    return bool(leaves([node], "quantity")) or any(leaf.data[0] != "parameters" for leaf in leaves([node], "slot"))


def _stops(system: System, bodies: Sequence[TreeBody], rows: Sequence[Row]) -> dict[str, Node]:
    """Return the functions that become positive where a run ends.

    As declared, where a mass is used up, and where a rope lies around none of a wheel any more.
    """
    declared = {name: switching_function(x) for name, x in named_nodes(system.stop).items()}
    varying = (body for body in bodies if body.name in system.bodies and system.bodies[body.name].varying)
    masses = {used_up(body.name): -body.mass.mass for body in varying}
    ropes = [row.rope_run for row in rows if row.rope_run is not None]
    passed = [(row.name, bend) for row in ropes for bend in row.path[1:-1]]
    behind = {(row.rope, row.path[0].pulley) for row in ropes if row.path[0].pulley}
    passed += [(row.name, row.path[-1]) for row in ropes if (row.rope, row.path[-1].pulley) in behind]
    names = ((row, x.pulley) for row, x in passed if x.pulley and not x.turns and x.radius.shadow != 0)
    wheels = {f"{row} leaves {pulley}": negate(quantity("wrap", (row, pulley))) for row, pulley in names}
    return {**declared, **masses, **wheels}


def _state_stops(system: System, elements: Sequence[LawElement]) -> dict[str, StateCondition]:
    """Return the states that end a run. Raises ModelError for those of unknown elements."""
    known = possible_words(elements)
    found = state_conditions(system.stop)
    for name, condition in found.items():
        with at("stop", name):
            condition.verify(known)
    return found


def _in_slots(slots: Mapping[Node, Node], part: Any) -> Any:
    return with_expressions(part, lambda node: substitute(node, slots)) if slots else part


def _declared_laws(resolved: System, slots: Mapping[Node, Node]) -> list[Node]:
    """Return the expressions of forces, constraints, rates and motions, curves at the coordinates of their joints."""
    written = expressions_in(resolved, ("forces", "constraints", "states", "inputs", "joints", "bodies"))
    nodes = [each.node for each in written if each.node.shadow is None]
    found = [node for node in nodes if not any(leaf.data[0] == PARAMETER for leaf in leaves([node], "quantity"))]
    for name, joint in resolved.joints.items():
        for free in joint.free_steps:
            if free.step.curve is not None:
                found += free.step.curve.at(slots[symbol(coordinate_names(name, joint)[free.q[0]])]).place
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Names and the slots that stand for them.


def _coordinates(system: System, joints: Iterable[str]) -> tuple[Coordinate, ...]:
    found = []
    for name in joints:
        joint = system.joints[name]
        starts = _starts(joint, "q", coordinate_names(name, joint), joint.coordinate_units)
        for (q, unit, value, known), zero in zip(starts, joint.zero_coordinates, strict=True):
            found.append(Coordinate(q, name, unit, as_node(zero) if value is None else value, value is not None, known))
    return tuple(found)


def _states(system: System) -> Iterator[Coordinate]:
    """Yield the declared states, whose rates are in names."""
    dimensions = Dimensions(system)
    for name, state in system.states.items():
        dimension = dimensions.of_state(name)
        unit = "" if dimension is None or str(dimension) == "1" else str(dimension)
        yield Coordinate(name, "", unit, state.initial, given=True, known=True, rate=state.rate)


def _speeds(system: System, joints: Iterable[str]) -> tuple[Speed, ...]:
    found = []
    for name in joints:
        joint = system.joints[name]
        for u, unit, value, known in _starts(joint, "u", speed_names(name, joint), joint.speed_units):
            found.append(Speed(u, name, unit, ZERO if value is None else value, value is not None, known))
    return tuple(found)


def _starts(
    joint: Joint, key: str, names: Sequence[str], units: Sequence[str]
) -> Iterator[tuple[str, str, Node | None, bool]]:
    """Yield names, units and start values of a joint's coordinates (q) or speeds (u), and whether they are known."""
    initial = (joint.initial if isinstance(joint, MovingJoint) else None) or Initial()
    marks = initial.marks(len(joint.coordinate_units))[: len(units)]  # a quaternion has one mark, and three speeds
    for name, unit, value, marked in zip(names, units, initial.values(key, len(units)), marks, strict=True):
        yield name, unit, value, marked and value is not None


def _slots(system: System, coordinates: Iterable[Coordinate], speeds: Iterable[Speed]) -> dict[Node, Node]:
    tables = {
        "parameters": list(system.parameters),
        "q": [c.name for c in coordinates],
        "u": [s.name for s in speeds],
        "inputs": list(system.inputs),
    }
    slots = {symbol(name): slot(array, i) for array, names in tables.items() for i, name in enumerate(names)}
    return {**_rates(slots, rate_names(system)), symbol("t"): TIME, **slots}


def _rates(known: Mapping[Node, Node], pairs: Iterable[tuple[str, str]]) -> dict[Node, Node]:
    """Return the known rates of coordinates, as `phi'` names them."""
    return {quantity("'", (q,)): known[symbol(u)] for q, u in pairs if symbol(u) in known}


def _joint_limits(system: System, slots: Mapping[Node, Node]) -> list[JointLimit]:
    made = []
    for name, joint in system.joints.items():
        found = getattr(joint, "limits", None)
        if found is None or not joint.free_steps:
            continue
        (coordinate,), (speed,) = coordinate_names(name, joint), speed_names(name, joint)
        if symbol(coordinate) in slots:
            made.append(JointLimit(name, coordinate, speed, found.lower, found.upper, found.velocity))
    return made
