"""Which rows are ropes, one for each run between wheels that turn with it, and how long are they at an instant?"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Measure, RopeLength, RopeSide, TangentDirection, TreeBody, WrapAngle
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import (
    Wrench,
    Wrenches,
    acceleration,
    add_force,
    add_force_at,
    angular_acceleration,
    angular_velocity,
    as_point,
    position,
    velocity,
)
from multibody_sym.mechanics.points import direction as world
from multibody_sym.mechanics.references import References
from multibody_sym.mechanics.row_records import Marker, MeanTensionRow, RopeBend, RopeRow, RopeSlipRow, RoughWheel
from multibody_sym.model.bodies import GROUND, IDENTITY, Pose, unit_vector
from multibody_sym.model.constraints import Pulley, Rope, Roughness
from multibody_sym.model.fields import Point
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import atan2, cos, exp, is_exactly, sign, sin, sqrt
from multibody_sym.scalars.limits import grip_coefficient
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, as_node, negate, slot
from multibody_sym.scalars.vectors import S, Vec, add, apply, apply_transposed, cross, dot, scale, subtract


def run_names(system: System, name: str) -> list[str]:
    """Return the names of a rope's rows: its own, or with the number of each run between wheels that it grips."""
    rope = system.constraints[name]
    assert isinstance(rope, Rope)
    count = 1 + sum(step in system.pulleys and system.pulleys[step].grips for step in rope.route[1:-1])
    return [name] if count == 1 else [f"{name}.{k}" for k in range(1, count + 1)]


def tension_names(system: System, name: str) -> list[str]:
    """Return the name of each tension of a rope: the rope's, with numbers where it grips wheels or rubs on them."""
    rope = system.constraints[name]
    assert isinstance(rope, Rope)
    over = [system.pulleys[step] for step in rope.route[1:-1] if step in system.pulleys]
    count = 1 + sum(pulley.grips or pulley.rough is not None for pulley in over)
    return [name] if count == 1 else [f"{name}.{k}" for k in range(1, count + 1)]


def rope_measures(references: References, name: str, rope: Rope) -> Iterator[tuple[str, Measure]]:
    """Yield the measures that the start takes of a rope, by the names under which rows ask for them."""
    runs = _runs(references, name, rope)
    for place in (place for run in runs for place in run):
        # where the model does not say on which side of a wheel the rope runs, the bend alone tells it
        if place.bend.radius.shadow != 0 and place.bend.beside is not None and _wrap_word(rope, place.step) is None:
            yield _side_name(name, place.step), RopeSide(name, place.step)
    for row, run in zip(run_names(references.system, name), runs, strict=True):
        grips = [end for end, place in ((0, run[0]), (1, run[-1])) if place.pulley and place.pulley.turns]
        if grips or rope.length is None:
            yield row, RopeLength(row, winds=bool(grips))
        for end in grips:
            yield _end_name(row, end), TangentDirection(row, end)
        for place in _rough_places(run):
            yield f"{row}.{place.step}", WrapAngle(f"{row}.{place.step}")


def rope_rows(references: References, name: str, rope: Rope) -> list[RopeRow]:
    """Return the rows of a rope. Raises ModelError for paths that no rope can take, with the place."""
    names, runs = run_names(references.system, name), _runs(references, name, rope)
    ends = [*runs[0], *runs[-1]]
    if rope.length is not None and (len(runs) > 1 or any(p.pulley and p.pulley.turns for p in ends)):
        raise ModelError(
            "what lies on wheels that turn counts to no length that could be given: leave length out, and place the "
            "bodies by their initial positions",
            number="M110",
        ).under("length")
    made = []
    number = 1
    for row, run in zip(names, runs, strict=True):
        path = [replace(place.bend, grip=None) for place in run]
        for end, k in ((0, 0), (1, -1)):
            pulley = run[k].pulley
            if pulley is not None and pulley.turns:
                grip = run[k].bend.grip
                assert grip is not None
                path[k] = replace(path[k], grip=replace(grip, start=references.constants[_end_name(row, end)].slot))
        length = references.constants[row].slot if row in references.constants else rope.length
        assert length is not None
        several = len(tension_names(references.system, name)) > 1
        rough = _rough_places(run)
        rubs = tuple(f"{row}.{place.step}" for place in rough)
        run_number, label = number if several else 0, rope.label or ""
        made.append(RopeRow(row, tuple(path), length, name, run_number, rubs=rubs, label=label))
        number += 1 + len(rough)
    return made


def may_slacken(references: References, rope: Rope) -> bool:
    """Return whether a rope holds one way only, as those do that rub on wheels.

    Raises ModelError for one that is always taut and is to rebound.
    """
    over = [references.system.pulleys[step] for step in rope.route[1:-1] if step in references.system.pulleys]
    loose = rope.slack or any(pulley.rough is not None for pulley in over)
    if not loose and rope.restitution not in (None, ZERO):
        raise ModelError(
            "a rope that is always taut never goes taut, so it does not rebound; add slack: true", number="M114"
        ).under("restitution")
    return loose


def rope_elements(references: References, name: str, rope: Rope) -> Iterator[LawElement]:
    """Yield the elements of a rope that may slacken, one for each run."""
    for row in rope_rows(references, name, rope):
        slips = list(rope_slips(references, row))
        # On several rough wheels presses the mean of both tensions there, on a single one the rope's own multiplier.
        names = [slip.name for _, slip, _ in slips]
        means = [
            MeanTensionRow(f"{name}.mean", row.name, tuple(names[:k]), tuple(names[k + 1 :]))
            for k, name in enumerate(names if len(names) > 1 else ())
        ]
        parts = []
        for k, (part, slip, rough) in enumerate(slips, 1):
            limits = _capstan(rough.sticking, slip.wrap), _capstan(rough.sliding, slip.wrap)
            parts.append(FrictionPart(part, (slip,), *limits, normals=(k if means else 0,), wrap=0))
        yield LawElement(
            row.name,
            "rope",
            ("constraints", name),
            (row, *means),
            frictions=tuple(parts),
            restitution=rope.restitution or ZERO,
            collides=rope.restitution is not None,
            words=("taut", "slack"),
            group=name,
        )


def _capstan(coefficient: Node, wrap: Node) -> Node:
    """Return the friction on a wheel over the mean of both tensions: 2 tanh(mu wrap / 2), as T1 = T2 exp(mu wrap)."""
    return ZERO if coefficient is ZERO else as_node(grip_coefficient(exp(coefficient * wrap)))


def rope_slips(references: References, row: RopeRow) -> Iterator[tuple[str, RopeSlipRow, Roughness]]:
    """Yield each wheel on which a run of rope rubs: the name of its friction, the row of the slip, how rough it is."""
    pulleys = references.system.pulleys
    for k in (k for k, bend in enumerate(row.path[1:-1], 1) if bend.rough):
        pulley = row.path[k].pulley
        slip, roughness = f"{row.name}.{pulley}", pulleys[pulley].rough
        assert roughness is not None
        ropes = (element for element in references.system.constraints.values() if isinstance(element, Rope))
        alone = sum(pulley in element.route for element in ropes) == 1
        wrap = references.constants[slip].slot
        yield (pulley if alone else slip), RopeSlipRow(slip, row, k, wrap), roughness


def _rough_places(run: Sequence[_Place]) -> list[_Place]:
    return [place for place in run[1:-1] if place.pulley is not None and place.pulley.rough is not None]


def _wrap_word(rope: Rope, step: str) -> str | None:
    return rope.wrap.get(step, rope.wrap.get(""))


def _end_name(row: str, end: int) -> str:
    return f"{row} at end {end + 1}"


def _side_name(rope: str, step: str) -> str:
    return f"{rope} at {step}"


@dataclass(frozen=True)
class _Place:
    """A place on a path: its name in the file, its pulley (None: a point), and the bend there."""

    step: str
    pulley: Pulley | None
    bend: RopeBend


def _runs(references: References, name: str, rope: Rope) -> list[list[_Place]]:
    """Return the path cut at each wheel between its ends that turns with the rope."""
    places = _places(references, name, rope)
    cuts = [k for k, p in enumerate(places[1:-1], 1) if p.pulley is not None and p.pulley.grips]
    ends = [0, *cuts, len(places) - 1]
    return [places[first : last + 1] for first, last in pairwise(ends)]


def _places(references: References, name: str, rope: Rope) -> list[_Place]:
    """Return the places of a path, with sides as the file gives them, or as the start measures them."""
    route, pulleys = rope.route, references.system.pulleys
    _verify_route(rope, pulleys)
    bends = []
    for index, step in enumerate(route):
        with at("path", index):
            try:
                bends.append(references.pulleys.get(step) or RopeBend(references.marker(step), ZERO, (ZERO, ZERO, ONE)))
            except ModelError as error:
                if not references.pulleys or not error.known or "." in step:
                    raise
                message, known = f"no body or pulley is called {step!r}", [*references.pulleys, *error.known]
                raise ModelError(message, number="M106", word=step, known=known) from error
    belt = route[0] == route[-1] and route[0] in pulleys
    made = []
    for k, (step, bend) in enumerate(zip(route, bends, strict=True)):
        pulley = pulleys.get(step)
        end = k in (0, len(route) - 1)
        near = (bends[k - 1], bends[(k + 1) % len(bends)]) if not end else (bends[-2], bends[1])
        beside = (near[0].at, near[1].at) if pulley is not None and (belt or not end) else None
        word = _wrap_word(rope, step) if pulley is not None else None
        if pulley is not None and end and not belt and word is None:
            near_drum = route[1] if k == 0 else route[-2]
            right, left = ('"-"', '"+"') if k == 0 else ('"+"', '"-"')
            raise ModelError(
                f"on which side the rope leaves drum {step} is not told. Seen against the drum's axis with {near_drum} "
                f"straight below it, a rope with wrap: {right} hangs down on the right, with wrap: {left} on the left "
                "(+ runs counter-clockwise in the order of the path)",
                number="M115",
            ).under("path")
        constant = references.constants.get(_side_name(name, step))
        measured = ZERO if constant is None else constant.slot
        side = measured if word is None else ONE if word == "+" else negate(ONE)
        turns = rope.turns.get(step, rope.turns.get("", 0)) if pulley is not None else 0
        made.append(_Place(step, pulley, replace(bend, side=side, beside=beside, turns=turns)))
    return made


def _verify_route(rope: Rope, pulleys: Mapping[str, Pulley]) -> None:
    """Raise ModelError for drums that are none, pulleys at an end or twice on a path, and words for other wheels."""
    route = rope.route
    for k, drum in enumerate(rope.wind):
        with at("wind", k):
            if drum not in pulleys:
                raise ModelError(f"no pulley is called {drum!r}", number="M106", word=drum, known=pulleys)
            if not pulleys[drum].turns:
                raise ModelError(
                    f"{drum} stands at a point and turns nothing; a drum is a pulley with body and radius",
                    number="M115",
                )
            if drum in route[1:-1]:
                raise ModelError(
                    f"{drum} stands between the ends of the path; a rope winds on a drum at its end", number="M115"
                )
    belt = route[0] == route[-1] and route[0] in pulleys and pulleys[route[0]].turns
    for k in (0, len(route) - 1):
        if route[k] in pulleys and not belt and route[k] not in rope.wind:
            with at("path", k):
                raise ModelError(
                    f"the rope ends on pulley {route[k]} and is fastened to nothing there: name a body's point, or, if "
                    f"it winds on it, write wind: {route[k]}",
                    number="M115",
                )
    for k, step in enumerate(route[:-1] if belt else route):
        if step in pulleys and step in route[:k]:
            with at("path", k):
                raise ModelError(
                    f"the rope runs over pulley {step} twice; declare a second pulley there", number="M115"
                )
    for word in ("wrap", "turns"):
        for name in getattr(rope, word):
            if name and (name not in pulleys or name not in route):
                over = [step for step in route if step in pulleys]
                with at(word, name):
                    raise ModelError(
                        f"the rope does not run over a pulley {name!r}", number="M106", word=name, known=over
                    )


# ----------------------------------------------------------------------------------------------------------------------
# Wheels that turn with their ropes: by which coordinates they turn about their axes, and relative to what.

_PARALLEL: Final = 1e-12


def pulley_bends(references: References) -> dict[str, RopeBend]:
    """Return every declared pulley as a bend; those that turn with their ropes with a grip."""
    made = {}
    for name, pulley in references.system.pulleys.items():
        with at("pulleys", name, "at" if pulley.body is None else "body"):
            centre = references.marker(pulley.at or pulley.body or "")
            bend = RopeBend(centre, pulley.radius, unit_vector(pulley.axis), name)
            bend = replace(bend, massless=pulley.is_held, rough=pulley.rough is not None)
            made[name] = bend if pulley.body is None else replace(bend, grip=_turning_wheel(references.bodies, bend))
    return made


def _turning_wheel(bodies: Sequence[TreeBody], wheel: RopeBend) -> RoughWheel:
    """Return how a wheel turns: the sum of the angles of all hinges about its axis between it and a body that keeps it.

    Raises ModelError where its own joint turns it otherwise, so that no coordinate tells whole turns.
    """
    index, axis, angle = wheel.at.body, wheel.axis, ZERO
    if index < 0 or bodies[index].name == GROUND:
        raise ModelError("ground turns with no rope; a pulley that stands still is {at: ..}", number="M115")
    while index >= 0:
        turned = _turn_about(bodies[index], axis)
        if turned is None:
            break
        own, axis = turned
        angle = angle + own
        index = bodies[index].parent
    if angle is ZERO:
        body = bodies[wheel.at.body]
        raise ModelError(
            f"joint {body.joint_name} does not turn {body.name} by an angle about the axis of the wheel, and nothing "
            "counts its turns; join it by a revolute or planar joint about that axis",
            number="M115",
        )
    # a unit vector normal to the axis: x where that is normal to it, else what is left of x, y or z
    sizes = [x.shadow if x.shadow is not None else 0.5 for x in axis]
    k = min(range(3), key=lambda i: (round(abs(sizes[i]), 6), i))
    part = dot(axis, IDENTITY[k])
    across = unit_vector(as_point([u - part * x for u, x in zip(IDENTITY[k], axis, strict=True)]))
    return RoughWheel(Marker(wheel.at.name, index, Pose()), axis, across, angle, ZERO)


def _turn_about(body: TreeBody, axis: Point) -> tuple[Node, Point] | None:
    """Return the angle by which a joint turns its body about an axis, and the axis in the parent's; else None."""
    here: Point = as_point(apply_transposed(body.frame_on_body.rotation, axis))
    angle, free = ZERO, iter(body.free_steps)
    for step in body.steps:
        places = next(free).q if step.motion is None else ()
        if not step.turns:
            continue
        if not step.is_hinge:
            return None
        factor = _parallel(step.turns[0], here)
        if factor is None:
            return None
        own = slot("q", places[0]) if step.motion is None else step.motion
        angle = angle + own if factor > 0 else angle - own
    return angle, as_point(apply(body.frame_on_parent.rotation, here))


def _parallel(a: Point, b: Point) -> int | None:
    """Return 1 or -1 for unit vectors that are equal or opposite whatever parameters are, else None."""
    if a == b:
        return 1
    across = [as_node(x).shadow for x in cross(a, b)]
    along = as_node(dot(a, b)).shadow
    if along is None or any(x is None or abs(x) > _PARALLEL for x in across):
        return 1 if a == b else None
    return 1 if along > 0 else -1


# ----------------------------------------------------------------------------------------------------------------------
# Ropes: straight segments between points and tangents of pulleys, the whole length, and what tensions do.


class NoDirectionError(ModelError, ZeroDivisionError):
    """No straight piece of rope leads from one place to the next: they are one place, or a wheel reaches over both.

    It is an ArithmeticError too, for callers that try other positions.
    """


@dataclass(frozen=True)
class Wheel:
    """A pulley with a radius on a rope's path, and the axis about which the rope turns to the left there (world).

    `normal` is the axis as it is declared, fixed on a `body`: the rope stays in the plane across it.
    """

    radius: S
    axis: Vec
    side: S
    normal: Vec
    body: int


@dataclass(frozen=True)
class Segment:
    """A straight piece of rope from the first to the second marker's body: its length and unit direction (world).

    On a wheel the piece is a tangent; frictionless wheels let the rope slide, so the rate of the rope's length and its
    derivative are those of a piece fixed to the wheel's centre with the tangent's direction and length. Wheels that it
    `grips` turn with it: it is fixed to their rims. What is `steady` keeps its direction n; of
    other pieces between circles `rims` are vectors with d = length n + sum rim x n, d from centre to centre. On
    a wheel it lies in its `plane`.
    """

    ends: tuple[Marker, Marker]
    length: S
    direction: Vec
    grips: tuple[Wheel | None, Wheel | None] = (None, None)
    steady: bool = False
    rims: tuple[Vec, ...] = ()
    plane: Wheel | None = None

    def touches(self, motion: Motion, end: int) -> Vec:
        """Return where the piece ends (world): its marker, or where it touches the wheel that it grips."""
        centre, wheel = position(motion, self.ends[end]), self.grips[end]
        return centre if wheel is None else add(centre, scale(-wheel.radius, cross(wheel.axis, self.direction)))


def segments(
    motion: Motion, path: Sequence[RopeBend], straight: Sequence[Point | None] = ()
) -> tuple[list[Segment], S]:
    """Return the straight pieces of a rope's path and its length, arcs on wheels and rope wound on them included.

    `straight` are the directions (world) of pieces that keep them, None where a piece does not.
    """
    centres = [position(motion, bend.at) for bend in path]
    wheels = [wheel_at(motion, path, k) for k in range(len(path))]
    pieces = []
    for k in range(len(path) - 1):
        ends, d = (path[k].at, path[k + 1].at), subtract(centres[k + 1], centres[k])
        held = straight[k] if straight else None
        grips = tuple(wheels[j] if path[j].grip is not None else None for j in (k, k + 1))
        if held is None:
            pieces.append(_tangent_piece(ends, d, wheels[k], wheels[k + 1], (grips[0], grips[1])))
        else:
            direction = motion.state.vector(held)
            pieces.append(Segment(ends, dot(direction, d), direction, (grips[0], grips[1]), steady=True))
    length = sum((piece.length for piece in pieces), 0)
    for bend, wheel, before, after in zip(path[1:-1], wheels[1:-1], pieces[:-1], pieces[1:], strict=True):
        if wheel is not None:
            length = length + wheel.radius * _wrap(motion, wheel, before, after)
            if bend.turns:
                length = length + wheel.radius * (bend.turns * motion.state.values([2 * PI])[0])
    first, last = ((path[k], wheels[k], pieces[k]) for k in (0, -1))
    return pieces, length + _wound_length(motion, *last) - _wound_length(motion, *first)


def sides(motion: Motion, path: Sequence[RopeBend]) -> list[S | None]:
    """Return to which side (1, -1; 0: none) a rope turns about each wheel's axis; None for points."""
    wheels = [wheel_at(motion, path, k) for k in range(len(path))]
    return [None if wheel is None else wheel.side for wheel in wheels]


def wheel_at(motion: Motion, path: Sequence[RopeBend], k: int) -> Wheel | None:
    """Return the wheel at bend k, None for a point; it has no radius where no side was found."""
    bend = path[k]
    if bend.radius.shadow == 0 or (k in (0, len(path) - 1) and bend.grip is None):
        return None
    radius, side, *components = motion.state.values([bend.radius, bend.side, *bend.axis])
    axis = apply(motion.rotation(bend.at.body), components)
    return Wheel(radius * side * side, scale(side, axis), side, axis, bend.at.body)


def inner_side(motion: Motion, bend: RopeBend) -> S:
    """Return on which side of a wheel a rope has the centre inside its bend: 1 to the left about the axis, -1, or 0.

    Where the rope runs straight back (both ends hang below the centre) the bend has no inside.
    """
    assert bend.beside is not None
    axis = apply(motion.rotation(bend.at.body), motion.state.values(bend.axis))
    centre, (before, behind) = position(motion, bend.at), (position(motion, marker) for marker in bend.beside)
    return sign(dot(axis, cross(subtract(centre, before), subtract(behind, centre))))


def _tangent_piece(
    ends: tuple[Marker, Marker],
    d: Vec,
    first: Wheel | None,
    second: Wheel | None,
    grips: tuple[Wheel | None, Wheel | None],
) -> Segment:
    """Return the common tangent of two circles whose centres are d apart (None: a point).

    With m = axis x n the left normal of the direction n: the tangent touches at c - r m, so d = l n + (r2 - r1) m and
    l^2 = d^2 - (r2 - r1)^2; where the second wheel turns the rope the other way, its radius counts negative. Raises
    NoDirectionError where points are at one place, or one is inside the wheel of the other.
    """
    square = dot(d, d)
    if first is None and second is None:
        length = sqrt(square)
        if isinstance(length, float) and length == 0.0:
            names = " and ".join(end.name for end in ends)
            raise NoDirectionError(f"{names} are at one place, and a rope between them has no direction: start apart")
        return Segment(ends, length, scale(1 / length, d))
    if first is None:
        assert second is not None
        step, axis = second.radius, second.axis
    elif second is None:
        step, axis = -first.radius, first.axis
    else:
        step, axis = second.radius * dot(first.axis, second.axis) - first.radius, first.axis
    rest = square - step * step
    if isinstance(rest, float) and rest <= 0.0:
        nearer, farther = (end.name for end in ends)
        raise NoDirectionError(
            f"{nearer} is {math.sqrt(square):g} m from {farther}, where no straight piece of rope leads from one to "
            f"the other: their wheels ask for more than {abs(step):g} m; start elsewhere (initial: {{q: ..}}), or give "
            "smaller radii",
            number="M119",
        )
    length = sqrt(rest)
    across = subtract(scale(length, d), scale(step, cross(axis, d)))
    rims = [scale(s * wheel.radius, wheel.axis) for s, wheel in ((-1, first), (1, second)) if wheel is not None]
    return Segment(ends, length, scale(1 / square, across), grips, rims=tuple(rims), plane=first or second)


def _wrap(motion: Motion, wheel: Wheel, before: Segment, after: Segment) -> S:
    """Return the angle between both tangents, so cut that it runs on past half a turn; of straight ones in full."""
    quarter, half = motion.state.values([PI / 2, PI])
    across, along = dot(wheel.axis, cross(before.direction, after.direction)), dot(before.direction, after.direction)
    if before.steady and after.steady:
        known = ((0, -1, half), (0, 1, 0), (1, 0, quarter))
        exact = (angle for x, y, angle in known if is_exactly(across, x) and is_exactly(along, y))
        return next(exact, quarter + atan2(-along, across))
    return quarter + atan2(-along, across)


def wrap_angle(motion: Motion, row: RopeRow, k: int) -> S:
    """Return around how much of the wheel at bend k a rope lies, full turns included; 0 at a point."""
    pieces, _ = segments(motion, row.path, row.straight)
    wheel = wheel_at(motion, row.path, k)
    if wheel is None:
        return 0
    (turns,) = motion.state.values([2 * row.path[k].turns * PI])
    return _wrap(motion, wheel, pieces[k - 1], pieces[k]) + turns


def wrap_between(motion: Motion, before: RopeRow, after: RopeRow) -> S:
    """Return around how much of the wheel a rope lies that two runs of it grip, one behind the other."""
    wheel = wheel_at(motion, before.path, len(before.path) - 1)
    assert wheel is not None
    pieces = [segments(motion, row.path, row.straight)[0] for row in (before, after)]
    return _wrap(motion, wheel, pieces[0][-1], pieces[1][0])


@dataclass(frozen=True)
class TensionForces:
    """Segments under tensions: the sum of tension times d(length)/dt, of that times d^2(length)/dt^2, and wrenches."""

    stretching: S
    stretching_rate: S
    of_body: list[Wrench]


def pull(
    motion: Motion, parts: Sequence[Segment], tensions: Sequence[S], bias: Sequence[tuple[Vec, Vec]]
) -> TensionForces:
    """Return the work and the wrenches of tensions in straight segments.

    d(length)/dt = sum n . dv;  d^2(length)/dt^2 = sum n . da + n' . dv. On a wheel that turns with the rope, r omega
    and r alpha about its axis are added: forces act at the rim.
    """
    wrenches = Wrenches(len(motion.bodies))
    stretching: S = 0
    stretching_rate: S = 0
    for part, tension in zip(parts, tensions, strict=True):
        dv = subtract(velocity(motion, part.ends[1]), velocity(motion, part.ends[0]))
        da = subtract(acceleration(motion, part.ends[1], bias), acceleration(motion, part.ends[0], bias))
        along = dot(part.direction, dv)
        rate, further = along, dot(part.direction, da)
        further = further + _direction_rate(motion, part, dv, along)
        for end, sense in enumerate((-1, 1)):
            wheel, marker, force = part.grips[end], part.ends[end], scale(-sense * tension, part.direction)
            if wheel is None:
                add_force(wrenches, motion, marker, force)
                continue
            rate = rate + sense * wheel.radius * dot(wheel.axis, angular_velocity(motion, marker.body))
            spinning = dot(wheel.axis, angular_acceleration(motion, marker.body, bias))
            further = further + sense * wheel.radius * spinning
            add_force_at(wrenches, motion, marker.body, part.touches(motion, end), force)
        stretching = stretching + tension * rate
        stretching_rate = stretching_rate + tension * further
    return TensionForces(stretching, stretching_rate, wrenches.of_body)


def _direction_rate(motion: Motion, part: Segment, dv: Vec, along: S) -> S:
    """Return n' . dv. Between points l n' = dv - (n . dv) n; in the plane across an axis a, n' . a = -n . a'."""
    if part.steady:
        return 0
    if part.plane is None:
        return (dot(dv, dv) - along * along) / part.length
    axis = part.plane.normal
    across = dot(cross(axis, part.direction), dv)
    tilting = dot(part.direction, cross(angular_velocity(motion, part.plane.body), axis))
    return across * across / part.length - dot(axis, dv) * tilting


def _wound_length(motion: Motion, bend: RopeBend, wheel: Wheel | None, piece: Segment) -> S:
    """Return the length of rope that a wheel which turns has wound up along a piece, since it stood at zero.

    A point of the rim runs away from the tangent point, which turns about the centre as the piece does.
    """
    if bend.grip is None or wheel is None:
        return 0
    (turned,) = motion.state.values([bend.grip.angle])
    if not piece.steady:
        x, y = _tangent_components(motion, bend, piece.direction)
        (start,) = motion.state.values([bend.grip.start])
        turned = turned - atan2(y * cos(start) - x * sin(start), x * cos(start) + y * sin(start))
    return wheel.side * wheel.radius * turned


def tangent_direction(motion: Motion, row: RopeRow, end: int) -> S:
    """Return the angle from `across` of its grip at which a run of rope meets the wheel at an end (0, 1)."""
    pieces, _ = segments(motion, row.path)
    x, y = _tangent_components(motion, row.path[-end], pieces[-end].direction)
    return atan2(y, x)


def _tangent_components(motion: Motion, bend: RopeBend, direction: Vec) -> tuple[S, S]:
    assert bend.grip is not None
    along, axis = (world(motion, bend.grip.frame, v) for v in (bend.grip.across, bend.grip.axis))
    return dot(direction, along), dot(direction, cross(axis, along))
