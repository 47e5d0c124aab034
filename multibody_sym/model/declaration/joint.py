"""What all joints have: ends, elementary steps, names and start values of coordinates, limits, prescribed motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.contacts import verify_restitution
from multibody_sym.model.declaration.doors import OTHERWISE
from multibody_sym.model.declaration.fields import Element, ListOf, Record, holds
from multibody_sym.model.declaration.steps import FreeStep, Step, free_steps
from multibody_sym.model.declaration.values import Flag, Flags, OptionalScalars, Scalar, Text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node


@dataclass(frozen=True)
class Joint(Element):
    """A joint from a body, point or frame of the parent to one of the child; both coincide at zero coordinates.

    All but parent and child is given by keyword: a letter behind them could be an axis or the name of a coordinate.
    Where joints close a loop one of them is cut and becomes constraints: the one marked `cut`.
    """

    kind: ClassVar[str]

    parent: str = holds(Text(), says="the body, point or frame that carries the joint", such="ground")
    child: str = holds(Text(), says="the body, point or frame that it carries", such="crank")
    cut: bool = holds(
        Flag(), False, keyword=True, such="true",
        says="whether this joint closes a loop by constraints, instead of having coordinates",
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        """The elementary motions that the kind of joint lets happen, from the parent outward."""
        return ()

    @property
    def moves(self) -> tuple[Step, ...]:
        """The elementary motions, those with a prescribed motion moving by it."""
        return self.steps

    @cached_property
    def free_steps(self) -> tuple[FreeStep, ...]:
        """The elementary motions that have coordinates, with their places among those of the joint."""
        return free_steps(self.moves)

    @property
    def coordinate_suffixes(self) -> tuple[str, ...]:
        """What follows the joint's name in the default names of its coordinates."""
        letters = [coordinate.letter for free in self.free_steps for coordinate in free.step.coordinates]
        several = any(len(step.coordinates) > 1 for step in self.steps) or len(self.steps) > 1
        return tuple(f"_{letter}" for letter in letters) if several else ("",) * len(letters)

    @property
    def speed_suffixes(self) -> tuple[str | None, ...]:
        """What follows the joint's name in the names of its speeds; None where a speed is a coordinate's rate."""
        letters = (speed.letter for free in self.free_steps for speed in free.step.speeds)
        return tuple(None if letter is None else f"_{letter}" for letter in letters)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """The units of the coordinates."""
        return tuple(coordinate.unit for free in self.free_steps for coordinate in free.step.coordinates)

    @property
    def speed_units(self) -> tuple[str, ...]:
        """The units of the speeds."""
        return tuple(speed.unit for free in self.free_steps for speed in free.step.speeds)

    @property
    def zero_coordinates(self) -> tuple[int, ...]:
        """The coordinates at which both frames coincide."""
        return tuple(coordinate.zero for free in self.free_steps for coordinate in free.step.coordinates)


def effort_unit(speed: str) -> str:
    """Return the unit of what does work along a speed in the unit `speed`: a force, or the moment of one."""
    return "N" if speed == "m/s" else "N*m"


@dataclass(frozen=True)
class Initial(Element):
    """The state of a joint at t = 0: `q` of its coordinates, `u` of its speeds; null (None) leaves one to be found.

    `known` values are held when closed loops are assembled: of the coordinates in a list that are, or with `True` of
    all, what is given. What is left out is found, whatever is marked. What is given is held before what is not, and
    never changed for its sake.
    """

    meant: ClassVar[Mapping[str, str]] = {
        OTHERWISE: "start values of coordinates stand under q, of speeds under u: {q: 30 deg, u: 2}"
    }

    q: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="30 deg",
        says="start values of the coordinates, in m or rad; null leaves one to be found",
    )
    u: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="2",
        says="start values of the speeds, in m/s or rad/s; null leaves one to be found",
    )
    known: bool | tuple[bool, ...] = holds(
        Flags(), False, such="true",
        says="whether given values are kept when closed loops are assembled; a list says so one by one",
    )

    def values(self, name: str, count: int) -> tuple[Node | None, ...]:
        """Return the values under the key `name` (q, u), None for each that is not given."""
        given: tuple[Node | None, ...] | None = getattr(self, name)
        return given or (None,) * count

    def marks(self, count: int) -> tuple[bool, ...]:
        """Return whether each of a joint's coordinates is marked, of which what is given is known."""
        return self.known if isinstance(self.known, tuple) else (self.known,) * count


@dataclass(frozen=True)
class Limits(Element):
    """How far (`lower`, `upper`), how fast (`velocity`) and with how much force or moment (`effort`) a joint may move.

    Stops hold the joint between `lower` and `upper`, and push only; it rebounds from them with `restitution`. Where
    they do not act (`acts=False`), and past the velocity, nothing stops it: `check` and the summary of a run tell where
    position and speed pass them. The effort is for programs that choose a drive.
    """

    meant: ClassVar[Mapping[str, str]] = {"min": "lower", "max": "upper", "e": "restitution"}

    lower: Node | None = holds(Scalar(), None, says="the lower stop of the coordinate, in m or rad", such="0")
    upper: Node | None = holds(Scalar(), None, says="the upper stop of the coordinate, in m or rad", such="0.5")
    velocity: Node | None = holds(
        Scalar(), None, says="the largest speed, in m/s or rad/s; runs tell when it is passed", such="2"
    )
    effort: Node | None = holds(
        Scalar(), None, such="50",
        says="the largest force or moment of a drive, in N or N*m; kept for programs that choose one",
    )
    restitution: Node | None = holds(
        Scalar(""), None, says="which part of the speed a stop gives back, 0 to 1; 0 if left out", such="0.3"
    )
    acts: bool = holds(
        Flag(), True, says="whether the stops hold; else runs only tell when they are passed", such="false"
    )

    def verify(self) -> None:
        verify_restitution("restitution", self.restitution)
        if self.lower is None or self.upper is None or self.lower.shadow is None or self.upper.shadow is None:
            return
        if self.lower.shadow > self.upper.shadow:
            raise ModelError(
                f"the lower limit {text(self.lower)} is above the upper one {text(self.upper)}", number="M109"
            )


@dataclass(frozen=True, kw_only=True)
class MovingJoint(Joint):
    """A joint with freedom: names and initial values of its coordinates.

    `motion` prescribes how it moves: an expression of t and parameters, or a list of one for each translation and
    rotation in turn, in which null (None) leaves that one free. What is prescribed has no coordinate; its drive shows
    in the joint's reaction.
    """

    q: tuple[str, ...] | None = holds(
        ListOf(Text(), least=1), None, says="names of its coordinates, one or a list", such="phi"
    )
    motion: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="2*t",
        says="how it is driven: an expression of t, or one for each freedom with null where it is free",
    )
    initial: Initial | None = holds(Record(Initial), None, says="where it starts and how fast", such="{q: 30 deg}")
    limits: Limits | None = holds(
        Record(Limits), None, says="how far, how fast and how strongly it may move", such="{lower: 0, upper: 1}"
    )
    label: str | None = holds(Text(), None, says="the letter or name that pictures show", such="A")

    @property
    def with_more(self) -> str:
        """What to write where it is to have more coordinates; empty where nothing gives it more."""
        return ""

    @property
    def stops(self) -> Limits | None:
        """The limits between which stops hold its coordinate, if there are any."""
        limits = self.limits
        bounded = limits is not None and limits.acts and not limits.lower is limits.upper is None
        return limits if bounded and self.free_steps else None

    @property
    def moves(self) -> tuple[Step, ...]:
        if self.motion is None:
            return self.steps
        given = iter(self.motion)
        return tuple(step.with_motion(next(given)) if step.may_be_prescribed else step for step in self.steps)

    def verify(self) -> None:
        self._verify_motion()
        if self.limits is not None and [len(step.speeds) for step in self.steps] != [1]:
            raise ModelError(
                f"limits are for joints with one freedom; a {self.kind} joint has more", number="M110"
            ).under("limits")
        coordinates, speeds = len(self.coordinate_units), len(self.speed_units)
        if self.q is not None and len(self.q) != coordinates:
            if coordinates == 0:
                raise ModelError(
                    f"{self._named} has no coordinate to give a name: leave it out", number="M110"
                ).under("q")
            advice = self.with_more if len(self.q) > coordinates else ""
            told = f"{self._named} has {coordinates} coordinates, q names {len(self.q)}{advice}"
            raise ModelError(told, number="M110")
        if self.initial is not None:
            with at("initial"):
                self._verify_initial(self.initial, {"q": coordinates, "u": speeds, "known": coordinates})
        for (*section, name), units in self._units().items():
            element = getattr(self, section[0]) if section else self
            if element is not None and units:
                with at(*section):
                    element.verify_unit(name, units)

    def _units(self) -> dict[tuple[str, ...], tuple[str, ...]]:
        """Return the units of what the joint is given about its coordinates, by where that stands: one for each."""
        found: dict[tuple[str, ...], tuple[str, ...]]
        found = {("initial", "q"): self.coordinate_units, ("initial", "u"): self.speed_units}
        if self.motion is not None:
            prescribed = [step.coordinates[0].unit for step in self.steps if step.may_be_prescribed]
            found["motion",] = tuple(prescribed)
        if self.limits is not None:
            (step,) = self.steps
            coordinate, speed = step.coordinates[0].unit, step.speeds[0].unit
            units = {"lower": coordinate, "upper": coordinate, "velocity": speed, "effort": effort_unit(speed)}
            found |= {("limits", name): (unit,) for name, unit in units.items()}
        return found

    def unit_at(self, path: Sequence[str]) -> str | None:
        """Return the unit of what stands at a path inside the joint, None where that does not depend on the joint."""
        for steps, units in self._units().items():
            if tuple(path[: len(steps)]) == steps:
                return units[int(path[-1]) if len(path) > len(steps) else 0]
        return None

    def _verify_initial(self, initial: Initial, counts: Mapping[str, int]) -> None:
        """Raise ModelError for a list of another length, and for one that tears a quaternion apart."""
        for name, wanted in counts.items():
            given = getattr(initial, name)
            if not isinstance(given, tuple):
                continue
            with at(name):
                if len(given) != wanted:
                    counted = f"{wanted} initial values here, got {len(given)}"
                    raise ModelError(f"{self._named} needs {counted}; null (None) leaves one out")
                for free in self.free_steps if name != "u" else ():
                    if free.step.unit_quaternion and len({given[k] is None or given[k] is False for k in free.q}) > 1:
                        raise ModelError(
                            "the last four are one quaternion (w, x, y, z): give all four or none", number="M110"
                        )

    @property
    def _named(self) -> str:
        return f"a {self.kind} joint" + (" whose motion is prescribed" if self.motion is not None else "")

    def _verify_motion(self) -> None:
        """Raise ModelError unless `motion` has an entry for each step that may be prescribed."""
        open_to_it = [step.may_be_prescribed for step in self.steps]
        if self.motion is None or len(self.motion) == sum(open_to_it):
            return
        with at("motion"):
            if not all(open_to_it):
                raise ModelError(
                    f"the rotation of a {self.kind} joint is a quaternion, which cannot be prescribed; choose three "
                    "angles instead (angles: xyz)"
                )
            raise ModelError(
                f"a {self.kind} joint moves by {len(open_to_it)} translations and rotations: give a motion or null for "
                f"each, got {len(self.motion)}",
                number="M110",
            )
