"""Questions to `solve`, and how a system is simulated."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.fields import (
    Choice,
    Count,
    Direction,
    Element,
    Flag,
    ListOf,
    MapOf,
    Names,
    Point,
    Record,
    Scalar,
    Text,
    content_of,
    describe,
    fields_of,
    holds,
    key_of,
    list_items,
    scalar,
    verify_keys,
)
from multibody_sym.model.state_words import Moment, MomentField, TimeOrMoment, state_condition, time_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sign_changes import is_condition
from multibody_sym.text.parser import KINEMATIC, parse_scalar
from multibody_sym.text.printer import text

_FORMS: Final = (
    "an expression, {of: body, after: time}, {coordinate: value}, {of: body, at: {coordinate: value}}, "
    "{max: expression}, {min: expression}, {value: expression, when: {coordinate: value}}, "
    "{find: parameter, so: equation}, {find: parameter, least: expression}, {limit: expression, let: {parameter: oo}}, "
    "{series: expression, in: parameter, through: power}, {formula: coordinate}, "
    "{formula: expression, of: coordinate}, {period_of: coordinate}, {advance: coordinate, of: coordinate}, "
    "{section: body, component: moment, at: place}, "
    "{amplitude: coordinate, of: input} (or phase, resonance, antiresonance), "
    "{transmissibility: coordinate, from: input}, {decrement: coordinate}, {damping: number of a mode}, "
    "{velocity: point}, {acceleration: point} or {instant_center: body}, {principal_axes: body}, "
    "{action: coordinate}, {bracket: [expression, expression]}, {canonical: {Q: expression, P: expression}}; "
    "c sticks (a state) and conditions may stand for {coordinate: value}"
)
FORCED: Final = ("amplitude", "phase", "resonance", "antiresonance", "transmissibility")
"""Keys of questions about the steady motion under an input."""
_ALONE: Final = (
    *("value", "when", "max", "min", "formula", "period_of", "decrement", "damping", "velocity", "acceleration"),
    *("instant_center", "action", "principal_axes", "bracket", "canonical"),
)
_SETS: Final[tuple[tuple[str, ...], ...]] = (
    *((key,) for key in _ALONE),
    *(("value", "when"), ("value", "after"), ("of", "after"), ("of", "at")),
    *(("find", "so"), ("find", "least"), ("find", "greatest"), ("limit", "let"), ("series", "in_", "through")),
    *((key, "of") for key in ("formula", "advance", *FORCED)),
    ("section", "component"),
)
"""The keys of each kind of question."""
_BESIDE: Final[Mapping[str, tuple[str, ...]]] = {
    "along": ("of",),
    "after": ("max", "min"),
    "until": ("max", "min"),
    "between": ("find",),
    "at": ("section",),
    "about": ("series",),
}
"""Keys that may stand beside the keys of a question."""
MOMENTUM: Final = "p_"
"""What stands before the name of a coordinate in that of its momentum."""
_MODES: Final = 1000
_RATES: Final = ("'", "''")


GREATEST: Final = "greatest"
"""The place of a section that transmits most."""
SECTION_FORCES: Final = ("axial", "shear", "moment")
"""What the section of a beam transmits."""


@dataclass(frozen=True)
class Extreme(Element):
    """The largest or least value (`kind`: max or min) of an expression over the motion."""

    kind: str = holds(Choice(("max", "min")), says="which of the two", such="max")
    of: Node = holds(Scalar(), says="the expression", such="y")

    def __str__(self) -> str:
        return f"{self.kind}({text(self.of)})"


@dataclass(frozen=True)
class Equation(Element):
    """left == right, which names answers; `extremes`: those that it asks for itself, by the names it has for them.

    `left_unit` and `right_unit`: the SI units of sides that are a number with one, `2 m`.
    """

    left: Node = holds(Scalar(), says="the left side", such="least")
    right: Node = holds(Scalar(), says="the right side", such="0")
    left_unit: str | None = holds(Text(), None, says="the SI unit of a left side that is a number with one", such="m")
    right_unit: str | None = holds(Text(), None, says="the SI unit of a right side that is a number with one", such="m")
    extremes: Mapping[str, Extreme] = holds(
        MapOf(Record(Extreme)), None, says="the largest and least values that it names itself"
    )

    def __str__(self) -> str:
        sides = (self.left, self.left_unit), (self.right, self.right_unit)
        found = " == ".join(text(side) if unit is None else f"{text(side)} {unit}" for side, unit in sides)
        for name, extreme in self.extremes.items():
            found = found.replace(name, str(extreme))
        return found


INFINITE: Final = ("oo", "-oo")


@dataclass(frozen=True)
class Tendency(Element):
    """A parameter or start value that tends to a value, or beyond all bounds."""

    name: str = holds(Text(), says="the parameter or start value, or the time t", such="M")
    to: Node | None = holds(Scalar(), None, says="the value to which it tends", such="0")
    bound: str | None = holds(Choice(INFINITE), None, says="the infinity to which it tends", such="oo")

    def __str__(self) -> str:
        return f"{self.name} -> {self.bound if self.to is None else text(self.to)}"


@dataclass(frozen=True)
class TendencyField:
    """One name and the value to which it tends: `{M: oo}`."""

    def accept(self, value: Any) -> Tendency:
        if isinstance(value, Tendency):
            return value
        if not isinstance(value, Mapping) or len(value) != 1:
            raise ModelError(f"expected a name and its limit such as {{M: oo}}, got {describe(value)}", number="M103")
        ((name, end),) = value.items()
        with at(str(name)):
            return Tendency(name, bound=end) if end in INFINITE else Tendency(name, Scalar().accept(end))

    def tree(self, value: Tendency) -> dict[str, str]:
        return {value.name: (value.bound or "") if value.to is None else text(value.to)}


_EXTREME: Final = re.compile(r"\b(max|min)\s*\(")


@dataclass(frozen=True)
class EquationField:
    """Two expressions with == between them: `least == 0`, `max(normal(c)) == 2*m*g`."""

    def accept(self, value: Any) -> Equation:
        if isinstance(value, Equation):
            return value
        sides = value.split("==") if isinstance(value, str) else []
        if len(sides) != 2:
            raise ModelError(f"expected an equation such as least == 0, got {describe(value)}", number="M103")
        extremes: dict[str, Extreme] = {}
        (left, left_unit), (right, right_unit) = (_read_side(side, extremes) for side in sides)
        return Equation(left, right, left_unit, right_unit, Names(extremes))

    def tree(self, value: Equation) -> str:
        return str(value)


def _read_side(side: str, extremes: dict[str, Extreme]) -> tuple[Node, str | None]:
    """Return one side of an equation, and its unit if it is a number with one.

    max and min of one expression become entries of `extremes`, and symbols with their names.
    """
    names: dict[Node, Node] = {}
    free = "extreme"
    while free in side:
        free += "_"
    place = 0
    while (call := _EXTREME.search(side, place)) is not None:
        end, depth, several = call.end(), 1, False
        while end < len(side):
            depth += {"(": 1, ")": -1}.get(side[end], 0)
            if depth == 0:
                break
            several |= side[end] == "," and depth == 1
            end += 1
        if end == len(side) or several:
            place = call.end()
            continue
        name, standing = f"{call[1]} {len(extremes) + 1}", f"{free}{len(extremes) + 1}"
        extremes[name] = Extreme(call[1], Scalar().accept(side[call.end() : end]))
        names[symbol(standing)] = symbol(name)
        side = f"{side[: call.start()]}{standing}{side[end + 1 :]}"
        place = call.start()
    written, dimension = parse_scalar(side.strip())
    return substitute(written, names), str(dimension) if dimension is not None and any(dimension) else None


@dataclass(frozen=True, kw_only=True)
class Ask(Element):
    """A question that `solve` answers.

    `of` and `after` ask for the path of a body in a time; with `along` for its displacement that way, which has a sign.
    `when` alone asks for the time at which a coordinate reaches a value (or returns to its start value), a condition
    becomes true or a state begins; 0 if it holds from the start on. `of` and `at` ask for the speed of a body then, or
    its velocity `along` a direction. Extremes over the motion may begin `after` a time. A `section` without `at` is
    answered by a formula of the place. Steady motions are those under an input F0*sin(w*t); a `phase` is in rad, a
    `transmissibility` is from an input of the same unit. Expressions may name other answers. The start of a question
    about a `stage` is that of the stage.
    """

    meant: ClassVar[Mapping[str, str]] = {
        "ask": "the equation names other answers and expressions itself, {find: mu, so: N == 1}",
    }

    value: Node | None = holds(
        Scalar(), None, says="an expression, at the start, at a moment (when) or after a time", such="fx(A)"
    )
    of: str | None = holds(
        Text(), None, such="block",
        says="the body whose path, displacement or speed is asked for, the input that drives a steady motion, or the "
        "coordinate on which a formula depends",
    )
    after: Node | None = holds(Scalar("s"), None, says="the time that has passed", such="4 s")
    when: Moment | None = holds(
        MomentField(), None, such="{x: 2 m}",
        says="the moment: a coordinate reaches a value, a condition comes true, or a state begins",
    )
    at: Node | Moment | str | None = holds(
        TimeOrMoment("m", (GREATEST,)), None, such="{x: 2 m}",
        says="the moment at which the speed of the body is asked for, or the place of a section along its beam; "
        "`greatest` is where it transmits most",
    )
    along: Point | None = holds(
        Direction(), None, says="the direction of the displacement or velocity that is asked for", such="x"
    )
    max: Node | None = holds(
        Scalar(), None, says="the expression whose largest value over the motion is asked for", such="y"
    )
    min: Node | None = holds(
        Scalar(), None, says="the expression whose least value over the motion is asked for", such="y"
    )
    until: Node | Moment | None = holds(
        TimeOrMoment(), None, says="the time or moment at which looking for the extreme ends", such="2 s"
    )
    find: str | None = holds(Text(), None, says="the parameter or start value that is to be found", such="v0")
    so: Equation | None = holds(
        EquationField(), None, says="the equation that is to hold, between answers and expressions", such="least == 0"
    )
    between: tuple[Node, ...] | None = holds(
        ListOf(Scalar(), 2, 2), None, says="two values between which it is looked for", such="[0, 10]"
    )
    least: Node | None = holds(
        Scalar(), None, says="the expression that is least for the value found, over answers", such="T"
    )
    greatest: Node | None = holds(
        Scalar(), None, says="the expression that is greatest for the value found, over answers", such="range"
    )
    limit: Node | None = holds(Scalar(), None, says="the expression whose limit is asked for, over answers", such="a")
    let: Tendency | None = holds(
        TendencyField(), None, says="the parameter or start value that tends to a value, oo or -oo", such="{M: oo}"
    )
    series: Node | None = holds(Scalar(), None, says="the expression that is expanded, over answers", such="T")
    in_: str | None = holds(Text(), None, says="the parameter or start value of the expansion", such="theta0")
    about: Node | None = holds(Scalar(), None, says="the value about which it is expanded; 0 if left out", such="0")
    through: int | None = holds(Count(0), None, says="the highest power that is kept", such="2")
    formula: Node | None = holds(
        Scalar(), None, such="x",
        says="the coordinate that is asked for as a function of time, or an expression as one of a coordinate (of)",
    )
    period_of: str | None = holds(Text(), None, says="the coordinate whose period is asked for", such="phi")
    advance: str | None = holds(
        Text(), None, says="the coordinate that is asked for how far it goes in a period of another (of)", such="phi"
    )
    section: str | None = holds(
        Text(), None, says="the beam that is cut: a body, or a frame of it, along whose x axis it lies", such="beam"
    )
    component: str | None = holds(
        Choice(SECTION_FORCES), None, such="moment",
        says="what the section transmits: axial force (tension positive), shear force or bending moment",
    )
    amplitude: str | None = holds(
        Text(), None, says="the coordinate whose amplitude under the harmonic input `of` is asked for", such="x"
    )
    phase: str | None = holds(
        Text(), None, says="the coordinate whose lag behind the harmonic input `of` is asked for", such="x"
    )
    resonance: str | None = holds(
        Text(), None, such="x",
        says="the coordinate whose amplitude under the input `of` is greatest at the frequency asked for",
    )
    antiresonance: str | None = holds(
        Text(), None, says="the coordinate that rests under the input `of` at the frequency asked for", such="x"
    )
    transmissibility: str | None = holds(
        Text(), None, such="x",
        says="the coordinate whose amplitude by that of an input is asked for; the key of the input is `from`",
    )
    decrement: str | None = holds(
        Text(), None, says="the coordinate whose logarithmic decrement is asked for", such="x"
    )
    damping: Node | None = holds(
        Scalar(""), None, says="the number of the mode whose damping ratio is asked for", such="1"
    )
    velocity: str | None = holds(Text(), None, says="the point whose velocity is asked for", such="rod.pin")
    acceleration: str | None = holds(Text(), None, says="the point whose acceleration is asked for", such="rod.pin")
    instant_center: str | None = holds(
        Text(), None, says="the body whose instantaneous centre is asked for", such="rod"
    )
    action: str | None = holds(
        Text(), None, says="the coordinate whose action and frequency are asked for", such="theta"
    )
    principal_axes: tuple[str, ...] | None = holds(
        ListOf(Text(), 1), None, such="plate",
        says="the body, or several that count as one, whose principal moments of inertia and axes are asked for",
    )
    bracket: tuple[Node, ...] | None = holds(
        ListOf(Scalar(), 2, 2), None, such="[x, p_x]",
        says="two expressions whose Poisson bracket is asked for; p_x is the momentum of x",
    )
    canonical: Mapping[str, Node] | None = holds(
        MapOf(Scalar()), None, such="{Q: p_x, P: -x}",
        says="new coordinates and momenta that are tested, each coordinate before its momentum",
    )
    stage: int | None = holds(
        Count(), None, such="1",
        says="the stage of the motion that it is about, by its number; the last one if left out",
    )

    @property
    def varied(self) -> str | None:
        """The parameter or start value whose values the question compares."""
        return self.in_ or self.find or (None if self.let is None else self.let.name)

    @property
    def is_of_vibrations(self) -> bool:
        """Whether it is about steady or fading vibrations, which a weight only shifts."""
        return any(getattr(self, name) is not None for name in (*FORCED, "decrement", "damping"))

    @property
    def is_of_phase_space(self) -> bool:
        """Whether it is about functions of coordinates and momenta."""
        return self.bracket is not None or self.canonical is not None

    @property
    def is_of_points(self) -> bool:
        """Whether it is about the motion of a point or body at the start by its kind, not by what it names."""
        return not (self.velocity is self.acceleration is self.instant_center is None)

    @property
    def is_kinematic(self) -> bool:
        """Whether it names no forces: it is about how points and bodies move, or about parameters and answers."""
        if self.is_of_vibrations or self.is_of_phase_space or self.section is not None:
            return False
        so = [] if self.so is None else [self.so.left, self.so.right, *(x.of for x in self.so.extremes.values())]
        one = (self.value, self.max, self.min, self.limit, self.series, self.least, self.greatest, self.formula)
        asked = leaves([x for x in (*one, *so) if x is not None], "quantity")
        return {leaf.data[0] for leaf in asked} <= {*KINEMATIC, *_RATES}

    def verify(self) -> None:
        given = {name for name in fields_of(Ask) if name != "stage" and getattr(self, name) is not None}
        kind = next((x for x in sorted(_SETS, key=len, reverse=True) if given.issuperset(x)), None)
        beside = given.difference(kind or ())
        if kind is None or any(not given.intersection(_BESIDE.get(name, ())) for name in beside):
            names = ", ".join(sorted(map(key_of, given)))
            other = f"; for a coordinate of this name write {{when: {{{names}: ..}}}}" if names in FORCED else ""
            raise ModelError(f"{{{names}}} is no known question{other}; ask with {_FORMS}", number="M104")
        if self.damping is not None and self.damping.shadow not in range(1, _MODES):
            raise ModelError("a mode is named by its number, {damping: 1}", number="M104").under("damping")
        if self.canonical is not None and (not self.canonical or len(self.canonical) % 2):
            message = "expected pairs, each coordinate before its momentum, {Q: .., P: ..}"
            raise ModelError(message, number="M103").under("canonical")
        place = time_of(self.at)
        with at("at"):
            if place is not None and self.section is None:
                MomentField().accept(text(place))  # which refuses it
            if self.section is None and self.at == GREATEST:
                raise ModelError("`at: greatest` is a place along a beam: {section: beam, ..}", number="M103")
            if self.at not in (None, GREATEST) and place is None and self.section is not None:
                message = f"a section is at a place along its beam, such as 2 m or l/2, or at {GREATEST}"
                raise ModelError(message, number="M103")


def _of_source(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return a question in whose keys `of` stands for the `from` of a transmissibility, which Python reserves."""
    if "from" not in value:
        return dict(value)
    if "transmissibility" not in value or "of" in value:
        message = "`from` names the input of a transmissibility, {transmissibility: x, from: base}"
        raise ModelError(message, number="M104")
    return {"of" if key == "from" else key: x for key, x in value.items()}


@dataclass(frozen=True)
class AskField:
    """A question: an expression, `{of: block, after: 4 s}`, `{x: 2 m}`, `c sticks`, `{max: y}`, and so on."""

    def accept(self, value: Any) -> Ask:
        if isinstance(value, Ask):
            return value
        if state_condition(value) is not None:
            return Ask(when=value)
        if not isinstance(value, Mapping):
            question = Ask(value=value)
            return Ask(when=question.value) if question.value is not None and is_condition(question.value) else question
        names = {key_of(name): name for name in fields_of(Ask)}
        if any(key in names for key in value):
            verify_keys(value, (*names, "from"), Ask.meant)
            return Ask(**{names[key]: content for key, content in _of_source(value).items()})
        if any(state_condition(given) is not None for given in value.values()):
            raise ModelError(f"{{{', '.join(map(str, value))}}} is no known question; ask with {_FORMS}", number="M104")
        if len(value) != 1:
            raise ModelError("name one coordinate and its value, such as {x: 2 m}")
        return Ask(when=value)

    def tree(self, value: Ask) -> Any:
        fields = fields_of(Ask).items()
        tree = {key_of(name): f.tree(getattr(value, name)) for name, f in fields if getattr(value, name) is not None}
        if "transmissibility" in tree:
            tree["from"] = tree.pop("of")
        only = next(iter(tree)) if len(tree) == 1 else None
        return tree[only] if only in ("value", "when") else tree


@dataclass(frozen=True)
class Baumgarte(Element):
    """Baumgarte's stabilisation: gamma - 2 alpha phidot - beta^2 phi; without alpha it is chosen from the step."""

    alpha: Node | None = holds(
        Scalar("1/s"), None, says="how fast errors of rates fade; chosen from the step if left out", such="20"
    )
    beta: Node | None = holds(
        Scalar("1/s"), None, says="how fast errors of positions fade; chosen from the step if left out", such="20"
    )


@dataclass(frozen=True, kw_only=True)
class Stabilisation(Element):
    """How constraints are kept: `projection` after each step, `baumgarte`, or `index_2`, as part of the equations."""

    baumgarte: Baumgarte | None = holds(
        Record(Baumgarte), None, says="Baumgarte's terms, which let errors fade", such="{alpha: 20, beta: 20}"
    )
    projection: bool | None = holds(
        Flag(), None, says="whether each step is brought back to what the constraints demand", such="true"
    )
    index_2: bool | None = holds(
        Flag(), None, says="whether constraints are solved as part of the equations of each step", such="true"
    )

    def verify(self) -> None:
        chosen = {"baumgarte": self.baumgarte is not None, "projection": self.projection, "index_2": self.index_2}
        if sum(map(bool, chosen.values())) > 1:
            names = [name for name, is_chosen in chosen.items() if is_chosen]
            raise ModelError(
                f"choose {' or '.join(names)}, not {'both' if len(names) == 2 else 'all of them'}", number="M110"
            )


@dataclass(frozen=True, kw_only=True)
class SmoothFriction(Element):
    """Smooth friction: below the speed `regularised` (m/s, or rad/s) it fades, and sticking bodies creep.

    A body that would stick creeps so fast that friction, mu N v / sqrt(v^2 + e^2), balances the other forces.
    """

    regularised: Node = holds(
        Scalar("m/s"), says="the speed below which friction fades; m/s, or rad/s where things turn", such="1e-3"
    )

    def verify(self) -> None:
        if self.regularised.shadow is not None and not self.regularised.shadow > 0.0:
            raise ModelError("it is a speed greater than zero", number="M109").under("regularised")


MULTIPLIERS: Final = ("basic", "minimum_norm")
"""Multipliers of redundant rows are zero; or those of all rows, times the rows' lengths, have the least norm."""
COORDINATES: Final = ("relative", "absolute")


@dataclass(frozen=True)
class SamplesField:
    """The number of samples, or their times: a list, an array, or a text with commas; times are held as a tuple."""

    unit: str | None = ""

    def accept(self, value: Any) -> Node | tuple[Node, ...]:
        if isinstance(value, str) and "," in value:
            value = value.removesuffix(",").split(",")  # one time is `0.5,`
        items = list_items(value)
        if items is None:
            return scalar(value, self.unit)
        if not items:
            raise ModelError("expected a number of samples or their times, got an empty list", number="M103")
        return tuple(content_of(k, x, Scalar("s")) for k, x in enumerate(items))

    def tree(self, value: Node | tuple[Node, ...]) -> Any:
        return [text(time) for time in value] if isinstance(value, tuple) else text(value)


@dataclass(frozen=True, kw_only=True)
class Settings(Element):
    """How a system is simulated, unless the call says otherwise.

    Absolute `coordinates` are those of each body, which every joint restricts. Dry friction is exact by default.
    """

    t_end: Node = holds(Scalar("s"), 10, says="when the run ends", such="2 s")
    step: Node | None = holds(
        Scalar("s"), None, says="a fixed step; if left out the method chooses its own", such="1 ms"
    )
    rtol: Node | None = holds(
        Scalar(""), None, says="relative tolerance of a method that chooses its step", such="1e-9"
    )
    atol: Node | None = holds(
        Scalar(""), None, says="absolute tolerance of a method that chooses its step", such="1e-9"
    )
    method: str = holds(Text(), "auto", says="the integration method, such as rk4 or radau_5", such="rk4")
    samples: Node | tuple[Node, ...] = holds(
        SamplesField(), 1001, such="501",
        says="number of rows of the result, evenly spaced, both ends among them; or a list of their times in s",
    )
    coordinates: str = holds(
        Choice(COORDINATES), COORDINATES[0], such="absolute",
        says="coordinates of joints (relative), or of each body (absolute)",
    )
    constraints: Stabilisation | None = holds(
        Record(Stabilisation), None, says="how constraints are kept during a run", such="{projection: true}"
    )
    project: bool = holds(
        Flag(), False, such="true",
        says="whether all start values, known ones too, may change as little as constraints need",
    )
    multipliers: str = holds(
        Choice(MULTIPLIERS), MULTIPLIERS[0], such="minimum_norm",
        says="which forces of redundant constraints are reported",
    )
    friction: SmoothFriction | None = holds(
        Record(SmoothFriction), None, such="{regularised: 1e-3}",
        says="makes dry friction smooth, which it is not otherwise",
    )

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        """Yield the contents of given fields as `Element.written`; times of samples are read in s."""
        for path, value, unit in super().written():
            yield path, value, "s" if isinstance(value, tuple) else unit

    @property
    def numbers(self) -> tuple[Node, ...]:
        """What is evaluated before a run: its end, step, tolerances and samples, as far as they are given."""
        samples = self.samples if isinstance(self.samples, tuple) else (self.samples,)
        given = (self.t_end, self.step, self.rtol, self.atol, *samples)
        return tuple(x for x in given if x is not None)
