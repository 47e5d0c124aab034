"""How do joints rub: which parts of a joint's own reaction press, along which rows is there friction?

A guide rubs with the force across its axis; with pads, so far apart on the child, each takes half of that force and its
share of the couple. A journal rubs about its axis at a radius, or two bearings do, a sleeve along and about it. On a
screw's thread, steep by tan a = lead / radius, a force N normal to the flank and T along it make the axial force
N cos a + T sin a.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, coulomb_coefficients
from multibody_sym.mechanics.points import as_point
from multibody_sym.mechanics.references import JointFreedom, References
from multibody_sym.mechanics.row_records import (
    NOWHERE,
    BrakingRow,
    ConstantMomentRow,
    ReactionRow,
    Row,
    RubbingRow,
)
from multibody_sym.mechanics.spanning_tree import normals_of
from multibody_sym.model.bodies import IDENTITY, ORIGIN, unit_vector
from multibody_sym.model.fields import Point
from multibody_sym.model.forces import Friction
from multibody_sym.model.joints import Custom, Joint, Spherical
from multibody_sym.model.steps import Follow, Rotate, ScrewStep, Step, Translate
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    Mat,
    Vec,
    add,
    apply,
    cross,
    dot,
    product,
    rotation_about,
    scale,
    subtract,
)

# ----------------------------------------------------------------------------------------------------------------------
# The parts of all friction in joints: of the reaction that presses, coefficients, errors of wrong fields.

NOWHERE_YET: Final = (NOWHERE, NOWHERE)
"""The frames of a reaction's parts before the joint's are known."""

Made = tuple[list[ReactionRow], list[FrictionPart]]
"""The rows of what presses in a joint, and its friction."""

_KINDS: Final = (
    "friction is for joints with a reaction that presses and coordinates of their own: prismatic, revolute, "
    "cylindrical, screw, curve, planar, universal, spherical, custom without screws, point in a plane; {!r} is "
    "another, or prescribed"
)
_PARALLEL: Final = 1e-9


def are_parallel(a: Vec, b: Vec) -> bool:
    """Return whether two unit vectors are parallel, as far as parameters have values."""
    shadows = [as_node(x).shadow for x in cross(a, b)]
    return all(x is not None and abs(x) < _PARALLEL for x in shadows)


@dataclass(frozen=True)
class Rubbing:
    """Friction declared in a joint, with the joint's freedoms; `flat`: nothing leaves the plane."""

    name: str
    element: Friction
    joint: Joint
    freedoms: tuple[JointFreedom, ...]
    flat: bool

    @property
    def rates(self) -> list[Node]:
        """The speeds of the joint."""
        return [freedom.rate for freedom in self.freedoms]

    def across(self, axis: Point, *, flat: bool | None = None) -> tuple[Point, ...]:
        """Return unit vectors across an axis: one where nothing leaves the plane."""
        if (self.flat if flat is None else flat) and axis[2] is ZERO:
            x, y, z = cross(IDENTITY[2], axis)
            return ((x, y, z),)
        return normals_of(axis)

    def reactions(self, shares: Sequence[tuple[Point, Point]], name: str = "") -> list[ReactionRow]:
        """Return rows of the reaction's parts along pairs of a force and a moment."""
        name = name or self.name
        names = [f"{name}.normal"] if len(shares) == 1 else [f"{name}.normal{k}" for k in range(1, len(shares) + 1)]
        pairs = zip(names, shares, strict=True)
        return [ReactionRow(row, self.element.joint, NOWHERE_YET, force, moment) for row, (force, moment) in pairs]

    def part(
        self, rows: tuple[Row, ...], normals: range, arm: Node = ONE, *, norm: bool = False, name: str = ""
    ) -> FrictionPart:
        """Return the friction of some normals at an arm."""
        element = self.element
        coefficients = coulomb_coefficients(element.static, element.kinetic)
        assert coefficients is not None
        static, kinetic, enough = coefficients
        limits = arm * static, arm * kinetic
        smooth = None if element.regularised is None else element.regularised / arm
        return FrictionPart(name or self.name, rows, *limits, enough, tuple(normals), norm, regularised=smooth, arm=arm)

    def radius(self, advice: str) -> Node:
        """Return the radius. Raises ModelError with advice where none is given."""
        if self.element.radius is None:
            raise ModelError(advice, number="M114").under("radius")
        return self.element.radius

    def another(self) -> ModelError:
        """Return the error of a joint whose friction has no model."""
        error = ModelError(_KINDS.format(self.element.joint), number="M114")
        error.under("joint")
        return error

    def without(self, field: str, advice: str) -> None:
        """Raise ModelError with advice where a field is given that says nothing here."""
        if getattr(self.element, field) is not None:
            raise ModelError(advice, number="M114").under(field)


# ----------------------------------------------------------------------------------------------------------------------
# Friction in joints of several freedoms: plates that slide on a plane, balls, and crosses that turn on two pins.
#
# A plate rubs against the velocity of the joint's point with mu times the normal force N. One that bears on a ring of
# a radius r rubs about its normal too: force F and couple C together have the size (F^2 + (C/r)^2)^(1/2) = mu N while
# it slides, against the velocity and r times the angular velocity. A ball in its socket rubs with mu r |F| against the
# angular velocity. Each pin of a universal joint is a journal, on which the force across it presses; so it is with
# freedoms of custom joints, one on the other, of which those that slide are guides.


def plate_friction(asked: Rubbing) -> Made:
    """Return the friction of a plate that slides on a plane, and may turn on it."""
    if asked.flat:
        raise ModelError(
            f"nothing presses along the normal of {asked.element.joint!r} in a model that stays in its plane; let a "
            "contact rub, or give the model what leaves the plane: a weight, a force",
            number="M114",
        ).under("joint")
    asked.without("length", "pads are for sliders and hinges; a plane joint rubs with the force along its normal")
    moves, radius = asked.joint.moves, asked.element.radius
    if len(moves) == 2:
        asked.without("radius", f"{asked.element.joint!r} does not turn, so that nothing rubs at a radius")
    first, second = (unit_vector(step.slides[0]) for step in moves[:2])
    normal: Point = unit_vector(as_point(cross(first, second)))
    turns_on_normal = all(are_parallel(step.turns[0], normal) for step in moves[2:])
    if not (are_parallel(cross(normal, first), second) and turns_on_normal):
        return stacked_friction(asked)
    speeds = [*asked.rates[:2], *([] if radius is None else [radius * asked.rates[2]])]
    rows = tuple(RubbingRow(f"{asked.name}.friction{k}", speed) for k, speed in enumerate(speeds, 1))
    return asked.reactions([(normal, ORIGIN)]), [asked.part(rows, range(1))]


def ball_friction(asked: Rubbing) -> Made:
    """Return the friction of a ball in its socket, against its angular velocity."""
    asked.without("length", "a ball has none; give its radius")
    radius = asked.radius("a ball rubs at its radius: give it")
    speeds = asked.rates
    if len(asked.joint.moves) > 1:  # the angular velocity along the parent's axes, where angles are chosen
        R: Mat = UNIT_MATRIX
        total: Vec = (ZERO, ZERO, ZERO)
        for step, freedom in zip(asked.joint.moves, asked.freedoms, strict=True):
            assert freedom.coordinate is not None
            axis = unit_vector(step.turns[0])
            total = add(total, scale(freedom.rate, apply(R, axis)))
            R = product(R, rotation_about(axis, freedom.coordinate))
        speeds = list(as_point(total))
    rows = tuple(BrakingRow(f"{asked.name}.friction{k}", speed) for k, speed in enumerate(speeds, 1))
    return asked.reactions([(unit, ORIGIN) for unit in IDENTITY]), [asked.part(rows, range(3), radius, norm=True)]


def _two_pins(asked: Rubbing) -> Made:
    """Return the friction of the two pins of a universal joint, on each of which the force across it presses."""
    asked.without("length", "bearings a length apart are for hinges; the pins rub with the joint's force alone")
    asked.radius("a universal joint rubs on its two pins: give their radius")
    return stacked_friction(asked)


def stacked_friction(asked: Rubbing) -> Made:
    """Return the friction of freedoms one on the other: guides and pins, each pressed by the force across it."""
    asked.without("length", "pads and bearings a length apart are for joints with one freedom")
    normals: list[ReactionRow] = []
    parts: list[FrictionPart] = []
    R: Mat = UNIT_MATRIX
    for k, (step, freedom) in enumerate(zip(asked.joint.moves, asked.freedoms, strict=True), 1):
        axis, turns = unit_vector((*step.turns, *step.slides)[0]), bool(step.turns)
        across = asked.across(axis, flat=asked.flat and not turns)
        name = f"{asked.name}.{'pin' if turns else 'slide'}{k}"
        own = range(len(normals), len(normals) + len(across))
        normals += asked.reactions([(as_point(apply(R, n)), ORIGIN) for n in across], name)
        row = (BrakingRow if turns else RubbingRow)(f"{name}.friction", freedom.rate)
        arm = asked.radius("what turns rubs on a pin: give its radius") if turns else ONE
        parts.append(asked.part((row,), own, arm, norm=len(across) > 1, name=name))
        if turns:
            assert freedom.coordinate is not None
            R = product(R, rotation_about(axis, freedom.coordinate))
    return normals, parts


# ----------------------------------------------------------------------------------------------------------------------

SIDE_WORDS: Final = ("pressed", "0")


def joint_frictions(references: References) -> Iterator[LawElement]:
    """Yield the elements of friction that joints declare. Raises ModelError for joints whose friction has no model."""
    for name, element in references.system.frictions.items():
        with at("forces", name):
            yield _joint_friction(name, element, references)


def _joint_friction(name: str, element: Friction, references: References) -> LawElement:
    with at("joint"):
        references.verify_joint(element.joint)
    joint = references.system.joints[element.joint]
    kinds = tuple(type(step) for step in joint.moves)
    make = ball_friction if isinstance(joint, Spherical) else _MAKERS.get(kinds)
    if make is None and kinds and set(kinds) <= {Translate, Rotate} and isinstance(joint, Custom):
        make = stacked_friction
    asked = Rubbing(name, element, joint, tuple(references.freedoms(element.joint).values()), references.flat)
    if make is None or any(step.motion is not None for step in joint.moves):
        raise asked.another()
    normals, parts = make(asked) if element.force is None else _constant(asked, kinds)
    frames = references.carried_frames(element.joint)
    return LawElement(
        name,
        "friction",
        ("forces", name),
        tuple(replace(row, frames=frames) for row in normals),
        unilateral=False,
        frictions=tuple(parts),
        words=SIDE_WORDS,
        group=name,
        joint=element.joint,
    )


def _constant(asked: Rubbing, kinds: tuple[type[Step], ...]) -> Made:
    """Return friction of a constant size, as if a force of this size pressed with the coefficient one."""
    if kinds not in ((Translate,), (Rotate,)):
        raise ModelError("friction of a constant force acts in a hinge or a slider", number="M114").under("force")
    defining, rubs = (ReactionRow, RubbingRow) if kinds == (Translate,) else (ConstantMomentRow, BrakingRow)
    force, name, none = asked.element.force, f"{asked.name}.normal", (ORIGIN, ORIGIN)
    assert force is not None
    row = defining(name, asked.element.joint, NOWHERE_YET, *none, constant=force)
    one = replace(asked, element=replace(asked.element, force=None, static=ONE, kinetic=ONE))
    return [row], [one.part((rubs(f"{asked.name}.friction", asked.rates[0]),), range(1))]


def _guide(asked: Rubbing) -> Made:
    asked.without("radius", "a slider has none; give the length over which its pads are apart, or nothing")
    axis = unit_vector(asked.joint.moves[0].slides[0])
    return _pads(asked, axis, asked.across(axis), RubbingRow(f"{asked.name}.friction", asked.rates[0]))


def _journal(asked: Rubbing) -> Made:
    radius = asked.radius("a hinge rubs on a journal: give its radius")
    axis, row = unit_vector(asked.joint.moves[0].turns[0]), BrakingRow(f"{asked.name}.friction", asked.rates[0])
    return _pads(asked, axis, normals_of(axis), row, radius)


def _pads(asked: Rubbing, axis: Point, across: Sequence[Point], row: Row, arm: Node = ONE) -> Made:
    """Return the reaction across an axis and its friction, or those of two pads or bearings a length apart along it.

    Of two it is one friction of both in a plane, in space one of each, from its own reaction across the axis.
    """
    name, length = asked.name, asked.element.length
    if length is None:
        normals = asked.reactions([(n, ORIGIN) for n in across])
        return normals, [asked.part((row,), range(len(normals)), arm, norm=len(normals) > 1)]
    half = ONE / 2  # of the force of both, and the moment about the axis across that each takes
    shares = [
        [(scale(half, n), scale(side / length, cross(axis, n))) for n in across] for side in (ONE, -ONE)
    ]
    normals = [x for k, pad in enumerate(shares, 1) for x in asked.reactions(pad, f"{name}.pad{k}")]
    if len(across) == 1:
        return normals, [asked.part((row,), range(2), arm)]
    rows = [replace(row, name=f"{name}.pad{k}.friction") for k in (1, 2)]
    return normals, [
        asked.part((each,), range(2 * k - 2, 2 * k), arm, norm=True, name=f"{name}.pad{k}")
        for k, each in enumerate(rows, 1)
    ]


def _sleeve(asked: Rubbing) -> Made:
    asked.without("length", "pads are for sliders; give a radius, with which it rubs about its axis as well")
    axis = unit_vector(asked.joint.moves[0].slides[0])
    if not are_parallel(axis, unit_vector(asked.joint.moves[1].turns[0])):
        return stacked_friction(asked)
    normals = asked.reactions([(n, ORIGIN) for n in normals_of(axis)])
    rows: tuple[Row, ...] = (RubbingRow(f"{asked.name}.along", asked.rates[0]),)
    if asked.element.radius is not None:
        rows += (RubbingRow(f"{asked.name}.about", asked.element.radius * asked.rates[1]),)
    return normals, [asked.part(rows, range(2), norm=True)]


def _thread(asked: Rubbing) -> Made:
    asked.without("length", "a screw has none; give the mean radius of its thread")
    radius = asked.radius("a screw rubs on its thread: give its mean radius")
    (step,) = asked.joint.moves
    assert isinstance(step, ScrewStep)
    size = sqrt(radius**2 + step.lead**2)
    cosine, sine = radius / size, step.lead / size
    rubbing = RubbingRow(f"{asked.name}.friction", size * asked.rates[0])
    axis = unit_vector(step.slides[0])
    normal = ReactionRow(
        f"{asked.name}.normal", asked.element.joint, NOWHERE_YET, axis, ORIGIN, cosine, sine, rubbing.name
    )
    return [normal], [asked.part((rubbing,), range(1))]


def _wire(asked: Rubbing) -> Made:
    """Return the friction of a bead, pressed by the force across its wire: one component in a plane, else three."""
    for field in ("radius", "length"):
        asked.without(field, "a bead on a wire rubs with the force across the wire; leave it out")
    step, (coordinate, *_) = asked.joint.moves[0].curve, asked.freedoms
    assert step is not None
    assert coordinate.coordinate is not None
    way = step.at(coordinate.coordinate).way
    length = sqrt(dot(way, way))
    x, y, z = scale(1 / length, way)
    row = RubbingRow(f"{asked.name}.friction", length * coordinate.rate)
    if asked.flat:
        normals = asked.reactions([((-y, x, ZERO), ORIGIN)])
        return normals, [asked.part((row,), range(1))]
    parts = [subtract(axis, scale(part, (x, y, z))) for axis, part in zip(step.axes, (x, y, z), strict=True)]
    normals = asked.reactions([((a, b, c), ORIGIN) for a, b, c in parts])
    return normals, [asked.part((row,), range(3), norm=True)]


_MAKERS: Final[dict[tuple[type[Step], ...], Callable[[Rubbing], Made]]] = {
    (Translate,): _guide,
    (Rotate,): _journal,
    (Translate, Rotate): _sleeve,
    (ScrewStep,): _thread,
    (Follow,): _wire,
    (Follow, Rotate): _wire,
    (Translate, Translate): plate_friction,
    (Translate, Translate, Rotate): plate_friction,
    (Rotate, Rotate): _two_pins,
}
