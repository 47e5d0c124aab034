"""`ask: {velocity: rod.pin}`: velocity and acceleration of a point, and the instantaneous centre of a body.

In: a solved start. Out: components and size, with formulas, and the lines of a book: v_B = v_A + omega x r from body to
body, the velocities that a loop makes equal, and accelerations with their centripetal and Coriolis parts.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import groupby
from typing import Any, ClassVar, Final

from multibody_sym.algebra.book_form import factored_form
from multibody_sym.algebra.quotient_functions import with_whole_angles
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.ask.question import AskedMotion, Question
from multibody_sym.answers.ask.working import Working, equation
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant, with_letters
from multibody_sym.answers.instant.letters import acceleration_names
from multibody_sym.answers.records import Formula, Line, Sentence, formulas_in
from multibody_sym.derivation.symbolic_start import ClosedForms
from multibody_sym.dynamics.programs.quantities import StateQuantities, point_named
from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import NO_WRENCH, direction, position, power
from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.mechanics.row_records import AngleRow, Marker, PositionRow, Row
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.fields import AXES
from multibody_sym.records import dataclass
from multibody_sym.scalars import vectors
from multibody_sym.scalars.elementary import BUILD, leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, quantity, real, symbol
from multibody_sym.scalars.vectors import Vec, apply
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

_SHORT: Final = 12
"""Up to how many letters of text a speed stands itself in equations."""
_LONG: Final = 60
"""From how many letters of text on coordinates of loops keep their names in equations."""


class _Parts:
    """Values at the start in the form of a book, and the axes along which a system moves."""

    def __init__(self, solved: SolvedInstant) -> None:
        self.solved = solved
        self.in_plane = moves_in_plane(solved.system)
        self.axes = AXES[:2] if self.in_plane else AXES

    def of(self, ask: Callable[[StateQuantities], Any], unit: str = "") -> Value:
        """Return what is asked for, its formula with shared factors in front where that is shorter."""
        found = with_letters(self.solved, lambda instant: {"": ask(instant)}, {"": unit})[""]
        if found.expression is None or found.value is None:
            return found

        def factored(forms: ClosedForms) -> Node:
            return factored_form(with_whole_angles(forms.of([as_node(ask(self.solved.nodes))])[0]))

        form = self.solved.closed(factored)
        if form is None or len(text(form)) >= len(text(found.expression)):
            return found
        if not self.solved.speeds_of_loops.isdisjoint(leaves([form], "symbol")):
            return found
        near = abs(evaluate_float([form], self.solved.sample)[0] - found.value) <= AGREEMENT * abs(found.value)
        return replace(found, expression=form) if near else found

    def expression(self, node: Node, unit: str) -> Value:
        ask = self.solved.asked(node)
        return self.of(lambda instant: ask(instant)[""], unit)

    def size(self, components: Iterable[Node], values: Iterable[Value], unit: str) -> Value:
        """Return the size of a vector, by the formulas of its components where these have more to share."""
        found, forms = self.expression(_size(components), unit), [x.expression for x in values]
        known = [x for x in forms if x is not None and self.solved.symbolic.letters.keys() >= {*leaves([x], "symbol")}]
        if found.expression is None or len(known) < len(forms):
            return found

        def put_together(forms: ClosedForms) -> Node:
            return factored_form(with_whole_angles(forms.of([_size(known)])[0]))

        form = self.solved.closed(put_together)
        is_shorter = form is not None and len(text(form)) < len(text(found.expression))
        return replace(found, expression=form) if is_shorter else found

    def form(self, ask: Callable[[StateQuantities], Any]) -> Node:
        """Return what is asked for as an expression, a number where it has no formula."""
        found = self.of(ask)
        form = real(found.value or 0.0) if found.expression is None else found.expression
        letters = self.solved.lettered.found if len(text(form)) > _LONG else None
        shorter = None if letters is None else letters.of(lambda instant: {"": ask(instant)}, "")
        return form if shorter is None or len(text(shorter)) >= len(text(form)) else shorter


def _size(components: Iterable[Node]) -> Node:
    return BUILD["sqrt"](sum((x * x for x in components), ZERO))


def _size_of_one(parts: Sequence[Value]) -> Value | None:
    """Return the size of a vector with one component in letters that is not zero; None of another one."""
    (only, *others) = [x for x in parts if x.value] or [Value(None)]
    if others or only.value is None or only.expression is None or not leaves([only.expression], "symbol"):
        return None
    form = only.expression.args[0] if only.expression.op == "neg" else only.expression
    return replace(only, value=abs(only.value), expression=BUILD["abs"](form))


# ----------------------------------------------------------------------------------------------------------------------
# Questions.


@dataclass(frozen=True)
class _PointQuestion(Question):
    """The velocity or acceleration of a point."""

    is_of_start = True
    quantity: ClassVar[str]

    point: str

    def words(self) -> str:
        return f"{self.quantity} of {self.point}"

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        parts = _Parts(motion.solved)
        components = {axis: quantity(self.quantity, (self.point, axis)) for axis in parts.axes}
        found = {f".{axis}": parts.expression(node, self.si_unit) for axis, node in components.items()}
        found[""] = _size_of_one([*found.values()]) or parts.size(components.values(), found.values(), self.si_unit)
        if parts.in_plane:
            working.steps.append(lambda: self.lines(PlaneMotion(parts)))
        return found

    @abstractmethod
    def lines(self, plane: PlaneMotion) -> Iterator[Line]:
        """Yield the lines that lead to the components."""


class VelocityQuestion(_PointQuestion):
    """The velocity of a point at the start."""

    keys = ("velocity",)
    quantity = "velocity"
    si_unit = "m/s"

    def lines(self, plane: PlaneMotion) -> Iterator[Line]:
        yield from plane.velocity_lines(self.point)


class AccelerationQuestion(_PointQuestion):
    """The acceleration of a point at the start."""

    keys = ("acceleration",)
    quantity = "acceleration"
    si_unit = "m/s^2"

    def lines(self, plane: PlaneMotion) -> Iterator[Line]:
        yield from plane.acceleration_lines(self.point)


@dataclass(frozen=True)
class InstantCenterQuestion(Question):
    """The point about which a body turns at the start."""

    is_of_start = True
    keys = ("instant_center",)
    si_unit = "m"

    body: str

    def words(self) -> str:
        return f"instantaneous centre of {self.body}"

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        parts = _Parts(motion.solved)
        if not parts.in_plane:
            with at("instant_center"):
                raise ModelError(
                    "a body has an instantaneous centre where all moves in the plane z = 0; ask for "
                    f"{{velocity: {self.body}}} and angular_velocity({self.body}, x)",
                    number="M110",
                )
        turning = quantity("angular_velocity", (self.body, "z"))
        if not parts.expression(turning, "rad/s").value:
            working.notes.append(f"{self.body} does not turn, and has no instantaneous centre")
            return {"": Value(None, unit="m")}
        x, y = (quantity("position", (self.body, axis)) for axis in parts.axes)
        v_x, v_y = (quantity("velocity", (self.body, axis)) for axis in parts.axes)
        pole = x - v_y / turning, y + v_x / turning
        working.steps.append(lambda: PlaneMotion(parts).pole_lines(self.body))
        return {f".{axis}": parts.expression(node, "m") for axis, node in zip(parts.axes, pole, strict=True)}


KINEMATIC_QUESTIONS: Final = (VelocityQuestion, AccelerationQuestion, InstantCenterQuestion)

# ----------------------------------------------------------------------------------------------------------------------
# The steps of a book, in the plane.

Pair = tuple[Node, Node]


@dataclass(frozen=True)
class Arm:
    """A part of the way to a point: `along` a body that turns, to the next joint or the point."""

    body: int
    reach: Pair

    def velocity(self, plane: PlaneMotion) -> Pair:
        """Return omega x r."""
        x, y = self.reach
        turning = plane.turning(self.body)
        return -(turning * y), turning * x

    def acceleration(self, plane: PlaneMotion) -> Pair:
        """Return alpha x r - omega^2 r."""
        x, y = self.reach
        alpha, square = plane.turning_rate(self.body), plane.turning(self.body) * plane.turning(self.body)
        return -(alpha * y + square * x), alpha * x - square * y


@dataclass(frozen=True)
class Slide:
    """A part of the way to a point: a joint slides `along` a direction of the body `on` which it slides."""

    body: int
    on: int
    along: Pair
    rate: Node
    second_rate: Node

    def velocity(self, _plane: PlaneMotion) -> Pair:
        """Return the speed along the direction."""
        x, y = self.along
        return self.rate * x, self.rate * y

    def acceleration(self, plane: PlaneMotion) -> Pair:
        """Return the acceleration along the direction, and Coriolis' 2 omega x v."""
        x, y = self.along
        coriolis = real(2.0) * (plane.turning(self.on) * self.rate)
        return self.second_rate * x - coriolis * y, self.second_rate * y + coriolis * x


class PlaneMotion:
    """How the bodies of a plane system move at its start, in the letters of a book."""

    def __init__(self, parts: _Parts) -> None:
        self.parts = parts
        self.mechanism: Mechanism = parts.solved.mechanism
        self._taken = {str(x.data) for x in self.mechanism.symbols}
        self._values: dict[Node, Node] = {}
        self._told: set[Node] = set()
        self._decided = {symbol(x) for x in parts.solved.begin.assembled}

    # --- letters ---------------------------------------------------------------------------------------------------

    def turning(self, body: int) -> Node:
        """Return the angular velocity of a body, as a letter where it is long or loops decide it."""
        return self._of_body("omega", body, "angular_velocity")

    def turning_rate(self, body: int) -> Node:
        """Return the angular acceleration of a body, likewise."""
        return self._of_body("alpha", body, "angular_acceleration")

    def _of_body(self, letter: str, body: int, of: str) -> Node:
        name = self.mechanism.bodies[body].name if body >= 0 else GROUND
        ask = self.parts.solved.asked(quantity(of, (name, "z")))
        made = symbol(free_name(f"{letter}_{name}", self._taken))
        if made not in self._values:
            self._values[made] = self.parts.form(lambda instant: ask(instant)[""])
            letters, value = self.parts.solved.lettered.found, self._values[made]
            named = leaves([value], "symbol")
            if letters is not None and (self._is_decided(value) or not letters.definitions.keys().isdisjoint(named)):
                self._values[made] = letters.turning(of, name) or value
        return made if self._is_of_loops(body) else self._short(made)

    def _is_decided(self, value: Node) -> bool:
        return bool(self._decided.intersection(leaves([value], "symbol")))

    def _short(self, letter: Node) -> Node:
        """Return the value of a letter where it is short and given, and no sum, else the letter."""
        value = self._values[letter]
        is_short = len(text(value)) <= _SHORT and not any(x.op in ("add", "sub") for x in postorder([value]))
        return value if is_short and not self._is_decided(value) else letter

    def _speed(self, place: int) -> Node:
        """Return a speed of the mechanism, likewise."""
        letter = symbol(self.mechanism.speeds[place].name)
        self._values.setdefault(letter, self.parts.form(lambda instant: instant.motion.state.u[place]))
        return letter if place in self._of_loops else self._short(letter)

    def _speed_rate(self, place: int) -> Node:
        """Return the rate of a speed, likewise."""
        letter = symbol(f"{acceleration_names(self.mechanism)[place]}''")
        self._values.setdefault(letter, self.parts.form(lambda instant: instant.udot[place]))
        return letter if place in self._of_loops else self._short(letter)

    @cached_property
    def _of_loops(self) -> frozenset[int]:
        """The speeds that loops decide: they keep their letters, as those of equations."""
        ends = {marker.body for row in self._loops for marker in row.frames}
        ends |= {k for row in self._others for k in self._acted_on(row)}
        bodies = {body for end in ends for body in self._up(end)}
        free = {k for body in bodies for step in self.mechanism.bodies[body].free_steps for k in step.u}
        columns = [{k: x for k, x in enumerate(row.jacobian) if x} for row in self.parts.solved.numbers.rows]
        free |= {k for row in self._others for k in columns[row]}
        rows = zip(self.mechanism.rows, columns, strict=True)
        driven = {k for row, found in rows if row.expression is not None and [*found.values()] == [1.0] for k in found}
        return frozenset(k for k in free - driven if symbol(self.mechanism.speeds[k].name) in self._decided)

    def _up(self, body: int) -> Iterator[int]:
        while body >= 0:
            yield body
            body = self.mechanism.bodies[body].parent

    def _is_of_loops(self, body: int) -> bool:
        """Return whether loops decide how a body turns."""
        turning = (step for k in self._up(body) for step in self.mechanism.bodies[k].free_steps if step.step.turns)
        return any(k in self._of_loops for step in turning for k in step.u)

    @cached_property
    def _loops(self) -> list[PositionRow]:
        """The rows by which joints close loops in the plane, and by which points stay on lines."""
        return [row for row in self.mechanism.rows if isinstance(row, PositionRow) and row.acts_in_plane]

    @cached_property
    def _others(self) -> list[int]:
        """The other rows that decide how bodies move, by number: rods, rolling, gears, velocities."""
        return [
            k
            for k, row in enumerate(self.mechanism.rows)
            if not isinstance(row, (PositionRow, AngleRow)) and row.acts_in_plane and row.restricts
        ]

    def _acted_on(self, row: int) -> list[int]:
        return [k for k, x in enumerate(self.parts.solved.nodes.rows[row].of_body) if x is not NO_WRENCH]

    def _given(self, node: Node) -> Node:
        return self.parts.form(lambda instant: instant.motion.state.values([node])[0])

    def letter_lines(self, lines: Sequence[Formula]) -> Iterator[Line]:
        """Yield what the letters of lines are, those first that others name."""
        given = {tuple(map(text, line.sides)) for line in lines}
        waiting = [*leaves([side for line in lines for side in line.sides], "symbol")]
        named: dict[Node, Node] = {}
        while waiting:
            letter = waiting.pop(0)
            value = self._values.get(letter, letter)
            if letter not in self._told and letter not in named and value is not letter:
                named[letter] = value
        self._told.update(named)
        for letter, value in named.items():
            if (text(letter), text(value)) not in given:
                yield equation(letter, value, "so")
        relative = dict.fromkeys(leaves(named.values(), "symbol"))
        yield from (equation(x, self._relative[x], "with") for x in relative if x in self._relative)

    @cached_property
    def _relative(self) -> dict[Node, Node]:
        """The speeds of joints that loops decide, by how their bodies turn."""
        found: dict[Node, Node] = {}
        for k, body in enumerate(self.mechanism.bodies):
            for step in body.free_steps:
                if len(body.steps) == len(step.u) == 1 and step.step.turns and step.u[0] in self._of_loops:
                    sense = self._component(partial(direction, frame=self._joint(k), components=step.step.turns[0]), 2)
                    turning = self.turning(k) - self.turning(body.parent)
                    found[symbol(self.mechanism.speeds[step.u[0]].name)] = sense * turning
        return found

    # --- ways from ground to points --------------------------------------------------------------------------------

    @cached_property
    def _chains(self) -> dict[int, list[Arm | Slide]]:
        """The way to each body's joint, by the number of the body."""
        found: dict[int, list[Arm | Slide]] = {-1: []}
        for k, body in enumerate(self.mechanism.bodies):
            found[k] = [*found[body.parent], *self._arm(body.parent, self._joint(k)), *self._slides(k)]
        return found

    def _joint(self, k: int) -> Marker:
        body = self.mechanism.bodies[k]
        return Marker(body.name, k, body.frame_on_body)

    def _arm(self, body: int, end: Marker) -> list[Arm]:
        """Return the arm from the joint of a body to an end; none where it has no length or ground carries it."""
        if body < 0 or self.turning(body) is ZERO is self.turning_rate(body):
            return []
        begin = self._joint(body)
        x, y = self._components(lambda motion: vectors.subtract(position(motion, end), position(motion, begin)))
        return [] if x is ZERO and y is ZERO else [Arm(body, (x, y))]

    def _components(self, vector: Callable[[Motion], Vec]) -> Pair:
        return self._component(vector, 0), self._component(vector, 1)

    def _component(self, vector: Callable[[Motion], Vec], axis: int) -> Node:
        return self.parts.form(lambda instant: vector(instant.motion)[axis])

    def _slides(self, k: int) -> Iterator[Slide]:
        """Yield how a body slides in its joint. Raises NoClosedFormError where the direction bends or turns in it."""
        body = self.mechanism.bodies[k]
        free = iter(body.free_steps)
        frame = Marker("", body.parent, body.frame_on_parent)
        turned = False
        for step, given in zip(body.steps, body.given, strict=True):
            own = None if given is not None else next(free)
            if step.slides and (turned or step.curve is not None):
                raise NoClosedFormError("a joint slides along a curve, or after it turns")
            turned = turned or bool(step.turns)
            for number, axis in enumerate(step.slides):
                x, y = self._components(partial(direction, frame=frame, components=axis))
                if given is not None:
                    yield Slide(k, body.parent, (x, y), self._given(given[1]), self._given(given[2]))
                elif own is not None:
                    place = own.u[number]
                    yield Slide(k, body.parent, (x, y), self._speed(place), self._speed_rate(place))

    def way(self, marker: Marker, carrier: int) -> list[Arm | Slide]:
        """Return the parts of the way to the point of a body that is where a marker is."""
        return [*self._chains[carrier], *self._arm(carrier, marker)]

    # --- lines -----------------------------------------------------------------------------------------------------

    def velocity_lines(self, point: str) -> Iterator[Line]:
        """Yield how loops decide velocities, and the velocity of a point from body to body."""
        marker = point_named(self.mechanism, point)
        yield from self._with_loops(VELOCITY, self._along(VELOCITY, point, self.way(marker, marker.body)))

    def acceleration_lines(self, point: str) -> Iterator[Line]:
        """Yield the same of accelerations, after the velocities in them."""
        marker = point_named(self.mechanism, point)
        yield from self._with_loops(VELOCITY, ())
        yield from self._with_loops(ACCELERATION, self._along(ACCELERATION, point, self.way(marker, marker.body)))

    def value_lines(self, asked: Node) -> Iterator[Line]:
        """Yield how what an expression names follows: points from body to body, how bodies turn and joints move."""
        letters: dict[_Law, list[Formula]] = {}
        for leaf in (*leaves([asked], "quantity"), *leaves([asked], "symbol")):
            name, arguments = leaf.data if leaf.op == "quantity" else ("", (leaf.data,))
            if name == VELOCITY.name:
                yield from self.velocity_lines(arguments[0])
            elif name == ACCELERATION.name:
                yield from self.acceleration_lines(arguments[0])
            else:
                found = self._letter(name, str(arguments[0]))
                if found is not None:
                    letters.setdefault(found[0], []).append(equation(found[1], found[1]))
        if letters:
            yield from self._with_loops(VELOCITY, (), letters.get(VELOCITY, ()))
        if ACCELERATION in letters:
            yield from self._with_loops(ACCELERATION, (), letters[ACCELERATION])

    def _letter(self, quantity_name: str, of: str) -> tuple[_Law, Node] | None:
        """Return the letter of an angular velocity, a speed or a rate that is asked for, and its law; else None."""
        if quantity_name == "angular_velocity":
            return VELOCITY, self.turning(self.mechanism.body_index(of))
        if quantity_name == "angular_acceleration":
            return ACCELERATION, self.turning_rate(self.mechanism.body_index(of))
        place = self._place(of, quantity_name)
        if place is None:
            return None
        return (ACCELERATION, self._speed_rate(place)) if quantity_name == "''" else (VELOCITY, self._speed(place))

    def _place(self, name: str, primes: str) -> int | None:
        """Return the place of a speed, or of the rate of a coordinate with primes; None for other names."""
        speeds = {x.name: k for k, x in enumerate(self.mechanism.speeds)}
        rates = {self.mechanism.coordinates[q].name: u for body in self.mechanism.bodies for q, u in body.rate_pairs}
        return (rates if primes else speeds).get(name)

    def pole_lines(self, body: str) -> Iterator[Line]:
        """Yield the instantaneous centre from the velocity of a body's joint."""
        k = self.mechanism.body_index(body)
        joint, turning = self._joint(k), self.turning(k)
        x, y = self._components(partial(position, marker=joint))
        v_x, v_y = _sum([VELOCITY.of(self, part) for part in self.way(joint, k)])
        pole = x - v_y / turning, y + v_x / turning
        name = self.mechanism.bodies[k].joint_name
        lines = [equation(symbol(f"{axis}_P"), form) for axis, form in zip("xy", pole, strict=True)]
        words = f"{body} turns about P: v = omega x r from P, so r_P = r_{name} + (-v_y, v_x)/omega with v of {name}"
        yield from self._with_loops(VELOCITY, (Sentence((words,)), *lines), [equation(turning, turning)])

    def _along(self, law: _Law, point: str, way: Sequence[Arm | Slide]) -> Iterator[Line]:
        yield Sentence((f"{law.name} of {point}, from body to body: {law.says}",))
        for part in way:
            yield self._part_line(law, part)
        total = _sum([law.of(self, part) for part in way])
        for axis, side in zip("xy", total, strict=True):
            yield equation(quantity(law.name, (point, axis)), side)

    def _part_line(self, law: _Law, part: Arm | Slide) -> Sentence:
        x, y = law.of(self, part)
        body = self.mechanism.bodies[part.body].name
        vector = (": (", x, ", ", y, ")")
        if isinstance(part, Arm):
            return Sentence((f"{body} turns, r = (", part.reach[0], ", ", part.reach[1], ")", *vector))
        return Sentence((f"{body} slides along (", part.along[0], ", ", part.along[1], ")", *vector))

    def _with_loops(self, law: _Law, lines: Iterable[Line], more: Iterable[Formula] = ()) -> Iterator[Line]:
        """Yield lines after those by which loops decide the letters in them."""
        after = [*lines]
        loops = [*(self._position_lines() if law is VELOCITY else ()), *self._loop_lines(law)]
        yield from loops
        formulas = formulas_in((*loops, *after, *more))
        yield from self.letter_lines(formulas)
        yield from after

    def _position_lines(self) -> Iterator[Line]:
        """Yield how loops close: the coordinates that follow, or the equations of those that have no formula."""
        solved = self.parts.solved
        pairs = zip(self.mechanism.coordinates, solved.symbolic.state.q, strict=True)
        letters = {symbol(c.name): as_node(q) for c, q in pairs if symbol(c.name) in self._decided}
        found = {**letters, **solved.symbolic.closings}
        for frames, group in groupby(self._loops, lambda row: row.frames):
            left, right = (self._components(partial(position, marker=marker)) for marker in reversed(frames))
            own = [*group]
            if len(own) > 1 and letters.keys() & {*leaves([*left, *right], "symbol")}:
                yield Sentence((f"{_element(own[0])} closes a loop: both sides have one place there",))
                for axis, a, b in zip("xy", left, right, strict=True):
                    yield equation(a, b, f"along {axis}")
        for letter, value in found.items():
            if value is not letter:
                yield equation(letter, value, "from how loops close")

    def _loop_lines(self, law: _Law) -> Iterator[Line]:
        """Yield which velocities or accelerations joints that close loops make equal."""
        for k in self._others:
            yield from self._row_line(law, k)
        for frames, group in groupby(self._loops, lambda row: row.frames):
            own = [*group]
            held, holder = frames[1], frames[0]
            element = _element(own[0])
            left = _sum([law.of(self, x) for x in self.way(held, held.body)])
            place = holder if len(own) > 1 else held
            right = _sum([law.of(self, x) for x in self.way(place, holder.body)])
            if len(own) > 1:
                yield Sentence((f"{element} closes a loop: both sides have one {law.name} there",))
                for axis, a, b in zip("xy", left, right, strict=True):
                    yield equation(a, b, f"along {axis}")
                continue
            if law is ACCELERATION and holder.body >= 0:
                yield from _unless_trivial(self._equation_of_speeds(law, self.mechanism.rows.index(own[0])))
                continue
            n = self._components(partial(direction, frame=holder, components=own[0].axis))
            a, b = (n[0] * v[0] + n[1] * v[1] for v in (left, right))
            yield from _unless_trivial(equation(a, b, f"{element}: {law.name} across"))

    def _row_line(self, law: _Law, number: int) -> Iterator[Line]:
        """Yield the equation of a row, where it says something: sum F . v + M omega of its bodies, else of speeds."""
        row = self.mechanism.rows[number]
        if law is ACCELERATION or row.expression is not None:
            yield from _unless_trivial(self._equation_of_speeds(law, number))
            return
        moving = ZERO
        for k in self._acted_on(number):
            (x, y), moment = self._wrench(number, k)
            v_x, v_y = _sum([law.of(self, part) for part in self._chains[k]])
            pushed = x * v_x + y * v_y
            moving = moving + (pushed + moment * self.turning(k))
        rest = ZERO
        if abs(self._power(self.parts.solved.numbers, number)) > AGREEMENT:
            rest = self.parts.form(lambda instant: self._power(instant, number))
        says = "velocity along it" if row.surfaces is None else "one velocity where both touch"
        yield from _unless_trivial(equation(moving, rest, f"{_element(row)}: {says}"))

    def _equation_of_speeds(self, law: _Law, number: int) -> Formula:
        """Return H u = -b, or H u' = gamma, of a row."""
        name = _element(self.mechanism.rows[number])
        rates = self._speed if law is VELOCITY else self._speed_rate

        def factor(instant: StateQuantities, k: int) -> Any:
            return instant.rows[number].jacobian[k]

        factors = (self.parts.form(partial(factor, k=k)) for k in range(len(self.mechanism.speeds)))
        left = sum((x * rates(k) for k, x in enumerate(factors) if x is not ZERO), ZERO)
        if law is ACCELERATION:
            right = self.parts.form(lambda instant: instant.rows[number].gamma)
            return equation(left, right, f"{name}: rate of its velocity equation")

        def known(instant: StateQuantities) -> Any:
            row, u = instant.rows[number], instant.motion.state.u
            return sum((a * x for a, x in zip(row.jacobian, u, strict=True)), -row.phidot)

        return equation(left, self.parts.form(known), f"{name}: velocity equation")

    def _power(self, instant: StateQuantities, number: int) -> Any:
        """Return sum F . v + M omega of a unit multiplier of a row: what its bodies' speeds do not decide."""
        motion, wrenches = instant.motion, instant.rows[number].of_body
        bodies = ((motion.bodies[k], wrenches[k]) for k in self._acted_on(number))
        return sum((power(body.v_WB, body.w_WB, wrench) for body, wrench in bodies), 0)

    def _wrench(self, row: int, k: int) -> tuple[Pair, Node]:
        """Return the force of a unit multiplier on a body, in the plane, and its moment about the body's joint."""
        joint = self._joint(k)

        def of(instant: StateQuantities, part: int) -> Any:
            force, moment = (apply(instant.motion.rotation(k), x) for x in instant.rows[row].of_body[k])
            arm = vectors.subtract(instant.motion.poses[k][1], position(instant.motion, joint))
            return (force[0], force[1], vectors.add(moment, vectors.cross(arm, force))[2])[part]

        x, y, m = (self.parts.form(partial(of, part=n)) for n in range(3))
        return (x, y), m


def kinematic_lines(solved: SolvedInstant, asked: Node) -> Iterator[Line]:
    """Yield how speeds and accelerations that an expression names follow, in the plane, each line once."""
    parts = _Parts(solved)
    said: list[Line] = []
    for line in PlaneMotion(parts).value_lines(asked) if parts.in_plane else ():
        if line not in said:
            said.append(line)
            yield line


@dataclass(frozen=True)
class _Law:
    """How velocities or accelerations add up from body to body; `of` gives what a part of the way adds."""

    name: str
    says: str
    of: Callable[[PlaneMotion, Arm | Slide], Pair]


VELOCITY: Final = _Law("velocity", "v_B = v_A + omega x r", lambda plane, part: part.velocity(plane))
ACCELERATION: Final = _Law(
    "acceleration",
    "a_B = a_A + alpha x r - omega^2*r, and a_rel + 2*omega x v_rel where a joint slides",
    lambda plane, part: part.acceleration(plane),
)


def _unless_trivial(line: Formula) -> Iterator[Formula]:
    if text(line.sides[0]) != text(line.sides[1]):
        yield line


def _element(row: Row) -> str:
    return row.name.rpartition(".")[0] or row.name


def _sum(pairs: Sequence[Pair]) -> Pair:
    x, y = (sum((pair[k] for pair in pairs), ZERO) for k in (0, 1))
    return x, y
