"""Elementary motions, of which every joint is made: what each kind is, and what the model asks of it.

A step leads frame F on to frame M. How it moves a body over floats, Nodes and sympy is said in `mechanics/motion.py`.
A new kind is a class here, or beside the joint that is made of it, that answers what is abstract, with its motion
there; everything else asks these questions only.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import count, islice
from typing import Any, Final, NamedTuple, Protocol, Self

from multibody_sym.errors import ModelError
from multibody_sym.model.fields import AXES, Choice, Element, Point, Record, Scalar, Text, holds
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import atan2, sqrt, substitute
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, quantity, slot, symbol
from multibody_sym.scalars.sign_changes import switching_functions
from multibody_sym.scalars.vectors import Vec
from multibody_sym.text.printer import text

_UNITS: Final[tuple[Point, ...]] = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


class Apart(Protocol):
    """Where frame M stands relative to frame F, and how it turns there, as expressions of the poses of two bodies."""

    def way(self, axis: Point) -> Node:
        """Return how far M is from F along a unit axis of F."""

    @property
    def angle(self) -> Node:
        """The angle from F to M about z, in the plane."""

    @property
    def quaternion(self) -> Sequence[Node]:
        """The unit quaternion of R_FM."""

    @property
    def turning(self) -> Vec:
        """The angular velocity of M relative to F, in the axes of M."""


class StepCoordinate(NamedTuple):
    """What ends a coordinate's name where the joint has several, its unit, and its value where M is not moved."""

    letter: str
    unit: str
    zero: int = 0


class StepSpeed(NamedTuple):
    """What ends a speed's name, None where it is the rate of the coordinate in its place; its unit."""

    letter: str | None
    unit: str


class Step(ABC):
    """An elementary motion: by coordinates of its own, or with `motion`, an expression of t, as given."""

    motion: Node | None

    @property
    @abstractmethod
    def coordinates(self) -> tuple[StepCoordinate, ...]:
        """Its coordinates, those that it has if it is not prescribed."""

    @property
    @abstractmethod
    def speeds(self) -> tuple[StepSpeed, ...]:
        """Its speeds, likewise."""

    @property
    @abstractmethod
    def may_be_prescribed(self) -> bool:
        """Whether an expression of t can stand for its coordinate."""

    @abstractmethod
    def with_motion(self, motion: Node | None) -> Self:
        """Return the step moving by an expression of t, or by its coordinate where that is None."""

    @property
    @abstractmethod
    def slides(self) -> tuple[Point, ...]:
        """The directions along which it moves M, in the axes that the steps before it have led to."""

    @property
    @abstractmethod
    def turns(self) -> tuple[Point, ...]:
        """The axes about which it turns M, likewise."""

    @abstractmethod
    def with_directions(self, change: Callable[[Point], Point]) -> Self:
        """Return the step with another vector for each that it was declared with."""

    @property
    @abstractmethod
    def is_hinge(self) -> bool:
        """Whether it turns M about one axis by its coordinate, and does nothing else."""

    @property
    @abstractmethod
    def stays_in_plane(self) -> bool:
        """Whether it keeps what lies in the plane z = 0 of the frame before it there."""

    @property
    @abstractmethod
    def in_child_axes(self) -> bool:
        """Whether its speeds are components along the axes of M, which then cannot be chosen otherwise."""

    @property
    @abstractmethod
    def unit_quaternion(self) -> bool:
        """Whether its coordinates are a unit quaternion (w first), its speeds the angular velocity in the axes of M."""

    @abstractmethod
    def is_measured(self, *, plane: bool) -> bool:
        """Return whether its coordinates follow from where M stands relative to F, in the `plane` or in space."""

    @abstractmethod
    def measured(self, apart: Apart) -> Sequence[Node]:
        """Return its coordinates from where M stands, if they follow from that."""

    @abstractmethod
    def measured_speeds(self, apart: Apart, rates: Sequence[Node]) -> Sequence[Node]:
        """Return its speeds from how M moves, and from the rates of its coordinates."""

    @property
    def speeds_are_rates(self) -> bool:
        """Whether each of its speeds is the rate of the coordinate in its place."""
        return all(speed.letter is None for speed in self.speeds)

    @property
    def drifts(self) -> bool:
        """Whether it moves M by itself while its coordinate rests."""
        return False

    @property
    def curve(self) -> Follow | None:
        """It, if it leads along a curve."""
        return None

    @property
    def is_independent(self) -> bool:
        """Whether it moves M freely along all its directions and about all its axes, none tied to another."""
        return len(self.slides) + len(self.turns) == len(self.speeds)


@dataclass(frozen=True)
class OneCoordinate(Step):
    """A step along or about an `axis` by one coordinate, whose rate is its speed.

    `letter` ends the coordinate's name where the joint has several.
    """

    axis: Point
    letter: str = ""
    motion: Node | None = field(default=None, kw_only=True)

    may_be_prescribed = True
    in_child_axes = False
    unit_quaternion = False

    @property
    @abstractmethod
    def unit(self) -> str:
        """The unit of the coordinate."""

    @property
    def coordinates(self) -> tuple[StepCoordinate, ...]:
        return (StepCoordinate(self.letter, self.unit),)

    @property
    def speeds(self) -> tuple[StepSpeed, ...]:
        return (StepSpeed(None, f"{self.unit}/s"),)

    def with_motion(self, motion: Node | None) -> Self:
        return replace(self, motion=motion)

    def with_directions(self, change: Callable[[Point], Point]) -> Self:
        return replace(self, axis=change(self.axis))

    def measured_speeds(self, apart: Apart, rates: Sequence[Node]) -> Sequence[Node]:
        return rates


@dataclass(frozen=True)
class Translate(OneCoordinate):
    """Translation by the coordinate along `axis`."""

    unit = "m"
    turns = ()
    is_hinge = False

    @property
    def slides(self) -> tuple[Point, ...]:
        return (self.axis,)

    @property
    def stays_in_plane(self) -> bool:
        return is_flat(self.axis)

    def is_measured(self, *, plane: bool) -> bool:
        return True

    def measured(self, apart: Apart) -> Sequence[Node]:
        return (apart.way(self.axis),)


@dataclass(frozen=True)
class Rotate(OneCoordinate):
    """Rotation by the coordinate about `axis`."""

    unit = "rad"
    slides = ()
    is_hinge = True

    @property
    def turns(self) -> tuple[Point, ...]:
        return (self.axis,)

    @property
    def stays_in_plane(self) -> bool:
        return is_upright(self.axis)

    def is_measured(self, *, plane: bool) -> bool:
        return plane  # in space poses do not tell whole turns

    def measured(self, apart: Apart) -> Sequence[Node]:
        return (as_node(apart.angle * self.axis[2]),)


@dataclass(frozen=True)
class ScrewStep(OneCoordinate):
    """Rotation by the coordinate about `axis`, with an advance along it by `lead` a radian."""

    lead: Node = ZERO

    unit = "rad"
    is_hinge = False
    stays_in_plane = False

    @property
    def slides(self) -> tuple[Point, ...]:
        return (self.axis,)

    @property
    def turns(self) -> tuple[Point, ...]:
        return (self.axis,)

    def is_measured(self, *, plane: bool) -> bool:
        return False

    def measured(self, apart: Apart) -> Sequence[Node]:
        raise TypeError("no rows stand for a screw, so that it always keeps its coordinate")


@dataclass(frozen=True)
class Ball(Step):
    """Free rotation: a unit quaternion (w first) as coordinates, the angular velocity in the axes of M as speeds."""

    motion = None
    may_be_prescribed = False
    slides = ()
    turns = _UNITS
    is_hinge = False
    stays_in_plane = False
    in_child_axes = True
    unit_quaternion = True

    @property
    def coordinates(self) -> tuple[StepCoordinate, ...]:
        return tuple(StepCoordinate(f"q{part}", "", int(part == "w")) for part in "wxyz")

    @property
    def speeds(self) -> tuple[StepSpeed, ...]:
        return tuple(StepSpeed(f"w{axis}", "rad/s") for axis in "xyz")

    def with_motion(self, motion: Node | None) -> Self:
        raise TypeError("free rotation has no coordinate for which an expression could stand")

    def with_directions(self, change: Callable[[Point], Point]) -> Self:
        return self

    def is_measured(self, *, plane: bool) -> bool:
        return True

    def measured(self, apart: Apart) -> Sequence[Node]:
        return apart.quaternion

    def measured_speeds(self, apart: Apart, rates: Sequence[Node]) -> Sequence[Node]:
        return tuple(map(as_node, apart.turning))


@dataclass(frozen=True)
class FreeStep:
    """A step that moves by coordinates, with the places of these (`q`) and of its speeds (`u`) among others."""

    step: Step
    q: tuple[int, ...]
    u: tuple[int, ...]

    @property
    def rate_pairs(self) -> tuple[tuple[int, int], ...]:
        """The places of coordinates with those of the speeds that are their rates."""
        return tuple((self.q[k], self.u[k]) for k, speed in enumerate(self.step.speeds) if speed.letter is None)


def free_steps(
    steps: Iterable[Step], q: Iterable[int] | None = None, u: Iterable[int] | None = None
) -> tuple[FreeStep, ...]:
    """Return those of steps that have coordinates, which have these places one after the other (from 0 if none)."""
    rest_q, rest_u = iter(count() if q is None else q), iter(count() if u is None else u)
    return tuple(
        FreeStep(step, tuple(islice(rest_q, len(step.coordinates))), tuple(islice(rest_u, len(step.speeds))))
        for step in steps
        if step.motion is None
    )


def is_flat(v: Point) -> bool:
    """Return whether a vector lies in the plane z = 0, whatever parameters are."""
    return v[2].shadow == 0


def is_upright(v: Point) -> bool:
    """Return whether a vector is normal to the plane z = 0, whatever parameters are."""
    return v[0].shadow == 0 and v[1].shadow == 0


# ----------------------------------------------------------------------------------------------------------------------
# Curves in a plane or in space: where they lead, as expressions of their parameter.


PARAMETER: Final = "parameter of a curve"
"""What the leaf of a parameter is called, with its name and unit: no name of the model, though one may be the same."""
_CURVE_UNITS: Final = ("rad", "m")
_EXAMPLE: Final = '{y: "x^2/2"}, or {x: "2*cos(s)", y: "sin(s)", parameter: s}'


@dataclass(frozen=True, kw_only=True)
class Curve(Element):
    """A smooth curve: `y` (or x, z) as an expression of x (or y, z), or `x`, `y`, `z` of a `parameter`.

    Without a `parameter` that is the coordinate that is not given: `{y: "x^2/(2*p)"}`; with one, what is left out is
    zero: `{x: "R*(s - sin(s))", y: "-R*(1 - cos(s))", parameter: s}`. Expressions name parameters of the model too, and
    t where a wire moves or bends by itself. The parameter is in m where it is a coordinate, else an angle, unless
    `unit` says the other (m, rad). Lengths are in m, along the axes of the frame that carries the curve.
    """

    x: Node | None = holds(
        Scalar("m"), None, says="x as an expression of the parameter, or of y or z", such="R*(s - sin(s))"
    )
    y: Node | None = holds(Scalar("m"), None, says="y as an expression of the parameter, or of x", such="x^2/(2*p)")
    z: Node | None = holds(Scalar("m"), None, says="z as an expression of the parameter, or of x and y", such="h*s")
    parameter: str | None = holds(
        Text(), None, says="the name of the parameter; if left out the coordinate that is not given", such="s"
    )
    unit: str | None = holds(
        Choice(_CURVE_UNITS), None, says="the unit of the parameter, where it is not what it seems", such="m"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        leaf = self.leaf
        for name, node in self._given.items():
            object.__setattr__(self, name, substitute(node, {symbol(leaf.data[1][0]): leaf}))
        self.__dict__.pop("_given", None)

    def verify(self) -> None:
        given = self._given
        if not given or (self.parameter is None and len(given) == len(AXES)):
            raise ModelError(f"say where the curve leads, by expressions of its parameter: {_EXAMPLE}")
        own = (self.leaf, symbol(self.leaf.data[1][0]))
        for name, node in given.items():
            if any(leaf in own for leaf in leaves(switching_functions([node]), "symbol", "quantity")):
                raise ModelError(
                    "a curve that guides is smooth, and this has a kink or a jump; declare a smooth part of it"
                ).under(name)
        if self.parameter is not None and not any(leaf in own for leaf in leaves(given.values(), "symbol", "quantity")):
            raise ModelError(f"no coordinate of the curve names {self.parameter!r}: {_EXAMPLE}").under("parameter")

    @cached_property
    def _given(self) -> dict[str, Node]:
        return {name: node for name in AXES if (node := getattr(self, name)) is not None}

    @property
    def leaf(self) -> Node:
        """What stands for its parameter, with name and unit."""
        given = self._given.values()
        made = (leaf for leaf in leaves(given, "quantity") if leaf.data[0] == PARAMETER)
        return next(made, None) or quantity(PARAMETER, self._named(given))

    def _named(self, given: Any) -> tuple[str, str]:
        if self.parameter is not None:
            plain = "m" if symbol(self.parameter) in given else "rad"
            return self.parameter, self.unit or plain
        named = {leaf.data for leaf in leaves(given, "symbol")}
        others = [name for name in AXES if name not in self._given]
        return next((name for name in others if name in named), (others or AXES)[0]), "m"

    @property
    def unit_of_parameter(self) -> str:
        """The unit of the curve's parameter, `m` or `rad` unless it is stated."""
        unit: str = self.leaf.data[1][1]
        return unit

    @property
    def place(self) -> Point:
        """Where it leads, as expressions of its parameter's leaf."""
        own = {} if self.parameter is not None else {self.leaf.data[1][0]: self.leaf}
        x, y, z = ({**own, **self._given}.get(name, ZERO) for name in AXES)
        return x, y, z


@dataclass(frozen=True)
class CurveField:
    """A curve; a file holds its parameter by name."""

    def accept(self, value: Any) -> Element:
        return Record(Curve).accept(value)

    def tree(self, value: Curve) -> dict[str, Any]:
        leaf = value.leaf
        found = {name: text(substitute(node, {leaf: symbol(leaf.data[1][0])})) for name, node in value._given.items()}
        words = {"parameter": value.parameter, "unit": value.unit}
        return found | {name: word for name, word in words.items() if word is not None}


# ----------------------------------------------------------------------------------------------------------------------
# The elementary motion along a curve.


_TIME = slot("t", 0)


class CurveRates(NamedTuple):
    """First and second derivatives of expressions by a curve's parameter s and the time t."""

    s: tuple[Node, ...]
    t: tuple[Node, ...]
    ss: tuple[Node, ...]
    st: tuple[Node, ...]
    tt: tuple[Node, ...]


class At(NamedTuple):
    """A place on a curve, and the derivative of the place by the parameter there."""

    place: Point
    way: Point


def rates(nodes: Sequence[Node], leaf: Node) -> CurveRates:
    s, t = (tuple(tangents(nodes, {each: ONE})) for each in (leaf, _TIME))
    ss, st = (tuple(tangents(s, {each: ONE})) for each in (leaf, _TIME))
    return CurveRates(s, t, ss, st, tuple(tangents(t, {_TIME: ONE})))


@dataclass(frozen=True)
class Follow(OneCoordinate):
    """A way along a curve by its parameter; with `turns_along`, in a plane, M turns so that its x is the tangent.

    `place` are expressions of the parameter's `leaf` along `axes`, unit vectors. (`axis` is that about which a tangent
    in a plane turns.)
    """

    place: Point = (ZERO, ZERO, ZERO)
    leaf: Node = ZERO
    across: tuple[Point, Point] = (_UNITS[0], _UNITS[1])
    turns_along: bool = field(default=False, kw_only=True)

    is_independent = False
    is_hinge = False

    @property
    def curve(self) -> Self:
        return self

    @classmethod
    def along(cls, curve: Curve, letter: str = "", *, turns_along: bool = False) -> Follow:
        return cls(_UNITS[2], letter, place=curve.place, leaf=curve.leaf, turns_along=turns_along)

    @property
    def axes(self) -> tuple[Point, Point, Point]:
        """The unit vectors along which `place` has its components."""
        return *self.across, self.axis

    @property
    def unit(self) -> str:
        unit: str = self.leaf.data[1][1]
        return unit

    @cached_property
    def rates(self) -> CurveRates:
        return rates(self.place, self.leaf)

    @cached_property
    def tangent(self) -> tuple[Node, Node]:
        """The unit tangent's components along the first two axes, of a curve in their plane."""
        x, y, _ = self.rates.s
        length = sqrt(x * x + y * y)
        return x / length, y / length

    def at(self, s: Node) -> At:
        """Return the place and its derivative at the parameter's value s."""
        x, y, z, *way = (substitute(node, {self.leaf: s}) for node in (*self.place, *self.rates.s))
        return At((x, y, z), (way[0], way[1], way[2]))

    @cached_property
    def turning(self) -> CurveRates:
        """The derivatives of the tangent's angle, of a curve in a plane."""
        x, y, _ = self.rates.s
        return rates((atan2(y, x),), self.leaf)

    def with_directions(self, change: Callable[[Point], Point]) -> Self:
        x, y, z = map(change, self.axes)
        return replace(self, axis=z, across=(x, y))

    @property
    def slides(self) -> tuple[Point, ...]:
        return tuple(axis for axis, way in zip(self.axes, self.rates.s, strict=True) if way is not ZERO)

    @property
    def turns(self) -> tuple[Point, ...]:
        return (self.axis,) if self.turns_along else ()

    @property
    def drifts(self) -> bool:
        return any(way is not ZERO for way in self.rates.t)

    @property
    def stays_in_plane(self) -> bool:
        moved = [axis for axis, way in zip(self.axes, self.place, strict=True) if way is not ZERO]
        return all(map(is_flat, moved)) and (is_upright(self.axis) or not self.turns_along)

    def is_measured(self, *, plane: bool) -> bool:
        return False

    def measured(self, apart: Apart) -> Sequence[Node]:
        raise TypeError("no rows stand for a curve, so that it always keeps its coordinate")
