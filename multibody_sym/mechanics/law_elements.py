"""Which elements hold one way only: contacts, slack ropes, stops, friction; what holds in a mode, within which limits?

Rows of a contact's normal, a rope or a stop are written phi >= 0, so that their multipliers, normal force and tension,
are >= 0 too and phi lambda = 0. Friction rows are directions t: phidot is the sliding speed v_t, the multiplier the
force along t, at most `static` times the normal force N while it sticks, -`kinetic` N sign(v_t) where it slides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import ClassVar, Final, Literal

from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.row_records import BodyFace, Marker, Multiplier, ReactionRow, Row, RowAround, SurfacePair
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import Kind
from multibody_sym.scalars.node import ONE, ZERO, Node, nodes_among, number, slot

INACTIVE: Final = 0
ACTIVE: Final = 1
STICKS: Final = 0
ALONG_VELOCITY: Final = 2
"""The slip of friction in space: against the sliding velocity, whichever way it leads."""

BOUNDLESS: Final = number(10**6)
"""The coefficient of friction that is always enough, in place of an infinite one: it slides only where the normal force
is no more than a millionth of the friction, which then alone keeps the contact closed."""



def coulomb_coefficients(static: Node | str | None, kinetic: Node | None) -> tuple[Node, Node, bool] | None:
    """Return the coefficients at rest and while sliding, and whether the first is always enough; None if it is smooth.

    One that is left out is the other.
    """
    if isinstance(static, str):
        return BOUNDLESS, BOUNDLESS if kinetic is None else kinetic, True
    given = nodes_among((static, kinetic))
    return (given[0], given[-1], False) if given else None


ElementKind = Literal["contact", "rope", "stop", "friction"]


@dataclass(frozen=True)
class FrictionPart:
    """Friction along one row, or in space two or three rows across each other, by Coulomb's law.

    `static` and `kinetic` are coefficients (m for rolling resistance, whose rows are of turning). With `enough` it
    never slips while it is pressed; both are `BOUNDLESS` then. N is the sum of the sizes of the multipliers of
    `normals`, places among those of its element, or with `norm` their length as a vector. With `wrap` it is a rope
    over a rough wheel: the coefficients are tanh(mu phi / 2), phi being the angle over which the rope of that row
    is in touch there, and N the mean tension. What turns rubs at an `arm` (m), by which the coefficients are
    multiplied already. `regularised` by a speed e it is -kinetic N v / sqrt(v^2 + e^2), never sticks, and creeps
    where it would.
    """

    name: str
    rows: tuple[Row, ...]
    static: Node
    kinetic: Node
    enough: bool = False
    normals: tuple[int, ...] = (0,)
    norm: bool = False
    wrap: int | None = None
    regularised: Node | None = None
    arm: Node = ONE

    @property
    def rubs(self) -> bool:
        return self.enough or not (self.static is self.kinetic is ZERO)


@dataclass(frozen=True)
class LawElement:
    """An element that holds one way only, or rubs.

    `unilateral`: its first normal row has a multiplier >= 0 and restricts motion while it is active; a rope that rubs
    on several wheels has a row more for the mean tension on each. Otherwise `normals` define components of a joint's
    reaction, of either sign. `words` are those for active and inactive; `path` is where the model declares it; parts of
    one declared element share a `group`. `open`: it does not touch at the start. `joint`: that in which a stop holds,
    or friction rubs. `collides`: its `restitution` is declared, so that there may be an impact without collision;
    `tangential_restitution` is the part of the tangential speed that an impact returns.
    """

    name: str
    kind: ElementKind
    path: tuple[str, str]
    normals: tuple[Row, ...]
    unilateral: bool = True
    frictions: tuple[FrictionPart, ...] = ()
    restitution: Node = ZERO
    collides: bool = False
    tangential_restitution: Node = ZERO
    words: tuple[str, str] = ("closed", "open")
    group: str = ""
    open: bool = False
    joint: str = ""

    @property
    def constant_forces(self) -> tuple[Node, ...]:
        """The sizes (N or N m) of constant friction in place of coefficients."""
        return tuple(row.constant for row in self.normals if isinstance(row, ReactionRow) and row.constant is not ZERO)

    @property
    def surfaces(self) -> SurfacePair | None:
        """The surfaces of both bodies that touch in a contact."""
        return self.normals[0].surfaces if self.normals else None

    @property
    def rows(self) -> Iterator[Row]:
        """All its rows: normals, then those of friction."""
        yield from self.normals
        for part in self.frictions:
            yield from part.rows

    def normals_of(self, part: FrictionPart) -> list[Row]:
        """Return the rows whose forces press a part."""
        return [self.normals[k] for k in part.normals]


_FACES: Final = 6
"""Of a box."""


def boxes_that_touch(elements: Iterable[LawElement]) -> dict[str, tuple[Sequence[BodyFace], Sequence[BodyFace]]]:
    """Return the contacts of two boxes in space among elements by name, with the faces of both."""
    boxes: dict[str, dict[int, Sequence[BodyFace]]] = {}
    for element in elements:
        for skin in element.surfaces or ():
            plane = skin.plane
            if plane is not None and len(plane.beside) == _FACES - 1:
                faces = (BodyFace(plane.place, plane.normal), *plane.beside)
                boxes.setdefault(element.group, {}).setdefault(skin.place.body, faces)
    pairs = ((name, tuple(of_body.values())) for name, of_body in boxes.items())
    return {name: (faces[0], faces[1]) for name, faces in pairs if len(faces) == 2}


PRESSING: Final = {"contact": "normal", "rope": "tension", "stop": "force", "friction": "normal"}
"""The component with which elements of a kind press, pull or stop."""
FRICTION: Final = "friction"


def components_of(part: FrictionPart, word: str) -> list[str]:
    """Return the names of a part's components by a word, with 1, 2 .. where it has several."""
    return [f"{word}_{k}" if len(part.rows) > 1 else word for k in range(1, len(part.rows) + 1)]


def component_word(element: LawElement, part: FrictionPart) -> str:
    """Return the name of a part's force among those of its element: `friction`, or the last word of its name."""
    return FRICTION if part.name == element.name else part.name.rpartition(".")[2]


def component_names(element: LawElement, part: FrictionPart) -> list[str]:
    """Return the names of a part's components among those of its element."""
    return components_of(part, component_word(element, part))


def _by_component(part: FrictionPart, word: str) -> dict[str, tuple[Row, ...]]:
    """Return the rows of a part's force, then of its components, by their names."""
    each = zip(components_of(part, word), part.rows, strict=True)
    return {word: tuple(part.rows), **{name: (row,) for name, row in each}}


def exerted_by(element: LawElement) -> dict[str, dict[str, tuple[Row, ...]]]:
    """Return the forces of an element by name and component, as expressions ask for them, each with its rows.

    What acts along several rows is the length of its components, `friction` that of `friction_1` and `friction_2`.
    Corners are asked alone and by their contact's name, friction in joints by its parts, as two pads. Ropes have
    tensions.
    """
    if element.kind == "rope":
        return {}
    found: dict[str, tuple[Row, ...]] = {PRESSING[element.kind]: element.normals[:1]}
    parts = element.frictions
    if not element.unilateral:
        return {x.name: found | _by_component(x, FRICTION) for x in parts}
    for part in parts:
        found |= _by_component(part, component_word(element, part))
    return dict.fromkeys((element.name, element.group) if element.kind == "contact" else (element.name,), found)


def row_forces(element: LawElement) -> Iterator[tuple[str, str, str]]:
    """Yield each row of an element, but of ropes, with the names of what exerts its force and of the component."""
    if element.kind == "rope":
        return
    if element.unilateral:
        yield element.normals[0].name, element.name, PRESSING[element.kind]
    for part in element.frictions:
        if not element.unilateral:
            yield from ((row.name, part.name, PRESSING[element.kind]) for row in element.normals_of(part))
        for row, component in zip(part.rows, component_names(element, part), strict=True):
            yield row.name, element.name, component


@dataclass(frozen=True)
class Share:
    """The forces of one element's rows where they are not unique: `forces` at first (N, of turning N m), by its rows.

    They change by combinations of `ways`, of which the last has as many numbers as there are rows and each before it
    one less: as little as need be, measured by how many of each it takes.
    """

    rows: tuple[str, ...]
    forces: tuple[float, ...]
    ways: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Shares:
    """How all rows of a mode share their forces; `room` is how far these are from bounds, by the largest force."""

    elements: tuple[Share, ...]
    room: float


@dataclass(frozen=True)
class Mode:
    """Which elements with laws are active and how they slide.

    `sides`: by element, 0 inactive, 1 active; of a joint's friction the sign of the reaction that presses, by the names
    of the normal rows where there are several. `slips`: by friction part of active elements, 0 sticks, 1 and -1 slides
    that way, 2 in space along the velocity. `directions`: unit vectors in which parts start to slide in space.

    Where forces are not unique, as of a box on two corners, a mode may name a basic solution: `idle` elements touch and
    carry nothing; of parts that rest, `carried` is 0 where they exert nothing, 1 or -1 where they are at their static
    limit as if they slid that way; of parts along several rows it is 0 by the name of a row that exerts nothing. Or all
    rows act, and `shares` holds the force of each.
    """

    sides: Mapping[str, int]
    slips: Mapping[str, int] = field(default_factory=dict)
    directions: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    carried: Mapping[str, int] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    shares: Shares | None = None

    def acts(self, element: LawElement) -> bool:
        """Return whether an element touches, is taut or is pressed."""
        return self.sides.get(element.name, INACTIVE) != INACTIVE

    def side(self, element: LawElement, normal: Row) -> int:
        """Return the side on which the force of a normal row presses, 0 where it has none."""
        return self.sides.get(normal.name, self.sides.get(element.name, INACTIVE))

    def slip(self, part: FrictionPart) -> int:
        """Return how a part slips."""
        return self.slips.get(part.name, STICKS)

    def alike(self, other: Mode) -> bool:
        """Return whether two modes are the same, whatever each element carries in them."""
        return replace(self, shares=None) == replace(other, shares=None)


# ----------------------------------------------------------------------------------------------------------------------
# The limits of elements, within which a mode lasts. Their values are those of `scalars.limits`, over any scalar.
#
#     kind     not negative                                beyond it
#     force    the normal force of what acts               it opens
#     gap      the distance of what does not act           it closes
#     side     a reaction in a joint, towards its side     it presses on the other side
#     cone     static N - |F| of what sticks               it slips
#     slip     the speed of what slips, in its direction   it stops


@dataclass(frozen=True)
class Limit:
    """A limit of an element: of its friction `part`, or of its normal row by number."""

    kind: Kind
    element: LawElement
    part: FrictionPart | None = None
    normal: int = 0


def limits_in(mode: Mode, element: LawElement) -> Iterator[Limit]:
    """Yield the limits of an element in a mode; one that touches and carries nothing is limited by its distance."""
    if element.unilateral:
        carries = mode.acts(element) and element.name not in mode.idle
        yield Limit("force" if carries else "gap", element)
        if not carries:
            return
    else:
        yield from (Limit("side", element, normal=k) for k in sided_normals(element))
    for part in element.frictions if mode.acts(element) else ():
        if part.regularised is None and part.rubs:
            if mode.slip(part) != STICKS:
                yield Limit("slip", element, part)
            elif part.static is not ZERO and not part.enough and part.name not in mode.carried:
                yield Limit("cone", element, part)


def sided_normals(element: LawElement) -> list[int]:
    """Return which normals of an element whose reactions are of either sign press by their size, each alone."""
    parts = [part for part in element.frictions if part.static is not ZERO and not (part.enough or part.norm)]
    return [k for k in range(len(element.normals)) if any(k in part.normals for part in parts)]


# ----------------------------------------------------------------------------------------------------------------------
# Impacts: what strikes and how, and the rows that make jumps of speeds of accelerations.
#
# An impact is the mechanism at rest without loads: with u = 0, no gravity, no forces but the given impulses, and for
# gamma the jump that a row is to have, udot are the jumps of the speeds, multipliers the impulses and reactions the
# impulses in the joints. `dynamics/contact/impact_problem.py` makes that mechanism.


MEETING: Final = "meeting"
"""The array of relative velocities, second against first, of points that meet without a normal: three for each pair."""


@dataclass(frozen=True)
class MeetingRow(Row):
    """Two points that meet: their relative velocity, first to second, along a unit vector in the axes of a frame.

    Along their normal it `closes`, and phi is how far they are apart; along tangents it rubs.
    """

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "force"
    laws: ClassVar[tuple[Node, ...]] = ()

    ends: tuple[Marker, Marker]
    axis: Point
    frame: Marker
    closes: bool = True

    @property
    def is_holonomic(self) -> bool:
        return self.closes

    @property
    def acts_in_plane(self) -> bool:
        return not is_upright(self.axis)

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends


@dataclass(frozen=True)
class JumpRow(RowAround):
    """A row in an impact: its speed is to change by `wanted`, and its multiplier is an impulse."""

    wanted: Node

    @property
    def laws(self) -> tuple[Node, ...]:
        return (*self.of.laws, self.wanted)


@dataclass(frozen=True)
class GivenRow(JumpRow):
    """A row in an impact that restricts nothing: its multiplier, an impulse, is `wanted`."""

    restricts = False


@dataclass(frozen=True)
class SpeedJump:
    """A prescribed motion whose rate jumps by `by`: that of a joint that moves as prescribed, or of a row."""

    name: str
    joint: str
    row: str
    by: Node


@dataclass(frozen=True)
class StruckImpacts:
    """An `impact:` section, resolved.

    `meetings` are its own pairs of points; `contacts` names declared elements that strike (None: all that close, if
    nothing else is declared). `loads` are given impulses and couples as forces. `begins` names the joints and
    constraints that did not hold before, with the rows of each; `jumps` prescribed motions. `restitutions` and
    `tangential` are coefficients that the section gives to declared contacts. `paths` say where each is declared.
    """

    meetings: tuple[LawElement, ...]
    contacts: tuple[str, ...] | None
    loads: tuple[Load, ...]
    begins: Mapping[str, tuple[str, ...]]
    jumps: tuple[SpeedJump, ...]
    restitutions: Mapping[str, Node] = field(default_factory=dict)
    tangential: Mapping[str, Node] = field(default_factory=dict)
    law: str | None = None
    sequence: str | None = None
    paths: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


INSTANT: Final = slot("instant", 0)
"""The time of an impact, which stands still while it lasts."""
JUMPED: Final = slot("jumped", 0)
"""0 before an impact and 1 after it, for prescribed motions whose rates jump."""
JUMP: Final = "jump"
"""The array of the jumps that rows of an impact are to have."""


def jump_leaf(row: int) -> Node:
    """Return the leaf for the jump of the speed of row number `row` of an impact."""
    return slot(JUMP, row)
