"""Forces as they are declared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final

from multibody_sym.errors import ModelError
from multibody_sym.model.contacts_and_impacts import (
    Coefficient,
    CoefficientField,
    KineticField,
    verify_coefficients,
    verify_not_negative,
)
from multibody_sym.model.fields import Element, ListOf, OneOf, Point, Scalar, ScalarOrVector, Text, Vector, holds
from multibody_sym.model.joints import effort_unit
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, constant_of


@dataclass(frozen=True)
class Force(Element):
    """A force with components along the axes of `frame` (a body, or a frame of one; ground), at a point of a body.

    Without `at` it acts at the centre of mass. `frame: ground.slope` takes the axes of a frame that ground declares.
    """

    meant: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("force", "F"), "value"),
        **dict.fromkeys(("magnitude", "direction"), "value has three components, [F*cos(a), F*sin(a), 0]"),
        "torque": "that is {type: torque, ..}",
    }

    on: str = holds(Text(), says="the body on which it acts", such="block")
    value: Point = holds(Vector("N"), says="its components along the axes of frame", such="[F*cos(a), F*sin(a), 0]")
    at: str | None = holds(
        Text(), None, says="the point of it where it acts; its centre of mass if left out", such="block.corner"
    )
    frame: str = holds(
        Text(), "ground", such="ground.slope",
        says="the body, or frame of one, along whose axes the components are; ground if left out",
    )


@dataclass(frozen=True)
class Distributed(Element):
    """A load along a line of a body: `value` is the force for each metre, which may name s, the distance from p (m).

    `between: [p, q]` are two points of the body. The components are along the axes of `frame` (a body, or a frame of
    one; ground if left out). Its integrals over s must have a closed form, as those of polynomials and sines have.
    """

    meant: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("q", "intensity", "load"), "value"),
        "at": "between: [p, q] names both ends of the line along which it acts",
    }

    on: str = holds(Text(), says="the body on which it acts", such="beam")
    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the points of it between which it acts; s counts from the first", such="[p, q]"
    )
    value: Point = holds(
        Vector("N/m"), such="[0, -q0*s/L, 0]",
        says="its components for each metre along the axes of frame, by the distance s from the first point",
    )
    frame: str = holds(
        Text(), "ground", such="ground.slope",
        says="the body, or frame of one, along whose axes the components are; ground if left out",
    )

    def __post_init__(self) -> None:
        """Write the points as references of the model: p of the body beam is beam.p."""
        super().__post_init__()
        own = (point.removeprefix(f"{self.on}.") for point in self.between)
        object.__setattr__(self, "between", tuple(f"{self.on}.{point}" for point in own))


@dataclass(frozen=True)
class Torque(Element):
    """A torque: `value` (one number) about the freedom of a joint, on its child and back on its parent; or on a body.

    A joint with several freedoms takes it (or a force, along a translation) at the one that `freedom` names by its
    coordinate or speed. On a body `value` has three components along the axes of `frame` (a body, or a frame of one;
    ground if left out). The point `at` which a couple acts matters to sections of the body alone.
    """

    value: Node | Point = holds(
        ScalarOrVector(), such="tau",
        says="one number for a joint (N*m, or N along a translation), three components for a body",
    )
    joint: str | None = holds(
        Text(), None, says="the joint in which it acts, on the child and back on the parent", such="A"
    )
    freedom: str | None = holds(
        Text(), None, says="which freedom of the joint, by its coordinate or speed, where it has several", such="J_phi"
    )
    on: str | None = holds(Text(), None, says="the body on which it acts, where it acts in no joint", such="rotor")
    frame: str = holds(
        Text(), "ground", such="ground.slope",
        says="the body, or frame of one, along whose axes the components of a body's torque are; ground if left out",
    )
    at: str | None = holds(
        Text(), None, says="the point of that body at which the couple acts, for sections of the body", such="middle"
    )

    @property
    def on_body(self) -> tuple[Node, Node, Node] | None:
        """The components of a torque on a body."""
        return self.value if isinstance(self.value, tuple) else None

    def verify(self) -> None:
        if (self.joint is None) == (self.on is None):
            raise ModelError("a torque acts either in a joint (joint:) or on a body (on:)", number="M110")
        _verify_freedom(self.freedom, self.joint)
        if self.at is not None and self.on is None:
            raise ModelError("at goes with on", number="M110").under("at")
        if (self.joint is None) == (self.on_body is None):
            raise ModelError("a joint's torque is one number, a body's torque a list of three")
        if self.on is not None:
            self.verify_unit("value", "N*m")

    def units(self, speed: str = "m/s") -> Mapping[str, str]:
        """Return the units of the fields for a speed of the unit `speed` along which it acts."""
        return {"value": "N*m" if self.on is not None else effort_unit(speed)}


@dataclass(frozen=True)
class SpringDamper(Element):
    """F = stiffness (length - l0) + damping d(length)/dt, pulling two points together, or acting in a joint.

    In a joint the coordinate of its freedom stands for the length and `length` for the unloaded coordinate; `freedom`
    names the coordinate where there are several.
    """

    meant: ClassVar[Mapping[str, str]] = {"k": "stiffness", "c": "damping", "d": "damping", "l0": "length"}

    stiffness: Node = holds(
        Scalar(), says="force for each metre (N/m), in a hinge moment for each radian (N*m)", such="k"
    )
    between: tuple[str, ...] | None = holds(
        ListOf(Text(), 2, 2), None, says="the two points that it pulls together", such="[ground.hook, block]"
    )
    joint: str | None = holds(Text(), None, says="the joint in which it acts, instead of between two points", such="A")
    freedom: str | None = holds(
        Text(), None, says="which freedom of the joint, by its coordinate, where it has several", such="J_phi"
    )
    damping: Node = holds(
        Scalar(), 0, says="force for each m/s (N*s/m), in a hinge moment for each rad/s (N*m*s)", such="c"
    )
    length: Node = holds(Scalar(), 0, says="the length without load; in a joint the coordinate without load", such="l0")

    def verify(self) -> None:
        _verify_place(self.between, self.joint)
        _verify_freedom(self.freedom, self.joint)
        if self.between is not None:
            verify_not_negative("length", self.length)

    def units(self, speed: str = "m/s") -> Mapping[str, str]:
        """Return the units of the fields for a speed of the unit `speed` along which it acts."""
        if speed == "m/s":
            return {"stiffness": "N/m", "damping": "N*s/m", "length": "m"}
        return {"stiffness": "N*m", "damping": "N*m*s", "length": "rad"}


@dataclass(frozen=True)
class Damper(Element):
    """F = damping d(length)/dt between two points, or against the speed of a joint's freedom."""

    damping: Node = holds(
        Scalar(), says="force for each m/s (N*s/m), in a hinge moment for each rad/s (N*m*s)", such="c"
    )
    between: tuple[str, ...] | None = holds(
        ListOf(Text(), 2, 2), None, says="the two points whose distance it damps", such="[ground.hook, block]"
    )
    joint: str | None = holds(Text(), None, says="the joint in which it acts, instead of between two points", such="A")
    freedom: str | None = holds(
        Text(), None, says="which freedom of the joint, by its coordinate or speed, where it has several", such="J_phi"
    )

    def verify(self) -> None:
        _verify_place(self.between, self.joint)
        _verify_freedom(self.freedom, self.joint)

    def units(self, speed: str = "m/s") -> Mapping[str, str]:
        """Return the units of the fields for a speed of the unit `speed` along which it acts."""
        return {"damping": "N*s/m" if speed == "m/s" else "N*m*s"}


@dataclass(frozen=True)
class Pull(Element):
    """A force that pulls two points together, by any law: `value` may name their `distance` and `distance_rate`.

    A law of `distance` and parameters alone has a potential energy, if its formula is found quickly. The work of all
    other laws counts as work.
    """

    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the two points that it pulls together", such="[sun, planet]"
    )
    value: Node = holds(
        Scalar("N"), such="k*(distance - l)",
        says="the force, which may name distance and distance_rate; negative where it pushes",
    )


@dataclass(frozen=True)
class Potential(Element):
    """A potential energy V, whose negative gradient is the force; `value` is V, in names that depend on its place.

    `between` two points: their `distance`. In a `joint` (or several `joints`): its coordinates. `on` a body (its centre
    of mass, or the point `at`): the place `x`, `y`, `z` of that point in a `frame` (a body, or a frame or point of one,
    default ground), which bears the opposite force. Parameters, inputs and the time may stand in all of them.
    """

    meant: ClassVar[Mapping[str, str]] = {"energy": "value", "potential": "value"}

    value: Node = holds(
        Scalar("J"), says="the energy, by distance, by the joint's coordinates, or by the place x, y, z", such="m*g*y"
    )
    between: tuple[str, ...] | None = holds(
        ListOf(Text(), 2, 2), None, says="two points whose distance it depends on", such="[a, b]"
    )
    joint: str | None = holds(Text(), None, says="the joint whose coordinates it depends on", such="A")
    joints: tuple[str, ...] | None = holds(
        ListOf(Text()), None, says="several joints whose coordinates it depends on", such="[A, B]"
    )
    on: str | None = holds(Text(), None, says="the body on whose place it depends", such="ball")
    at: str | None = holds(Text(), None, says="the point of that body; its centre of mass if left out", such="ball.tip")
    frame: str | None = holds(
        Text(), None, such="ground",
        says="where x, y, z are measured: a body, or a frame or point of one; ground if left out",
    )

    def verify(self) -> None:
        if sum(x is not None for x in (self.between, self.joint, self.joints, self.on)) != 1:
            raise ModelError(
                "a potential is one of the distance of two points (between: [a, b]), of a joint's coordinates "
                "(joint: or joints:), or of the place of a point (on:)",
                number="M110",
            )
        if self.joints == ():
            raise ModelError("it names no joint", number="M102").under("joints")
        for name in ("at", "frame"):
            if getattr(self, name) is not None and self.on is None:
                raise ModelError(f"{name} goes with on", number="M110").under(name)


@dataclass(frozen=True)
class Gravitation(Element):
    """Newton's attraction of two bodies, V = -constant m1 m2/distance, at their centres of mass or at points of them.

    `masses` are those of the bodies unless they are given, as they must be for ground.
    """

    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the two bodies, or points of them, that attract each other", such="[sun, planet]"
    )
    constant: Node = holds(Scalar("N*m^2/kg^2"), 6.67430e-11, says="the constant of gravitation", such="6.67430e-11")
    masses: tuple[Node, ...] | None = holds(
        ListOf(Scalar("kg"), 2, 2), None, says="the two masses; if left out those of the bodies", such="[M, m]"
    )


@dataclass(frozen=True)
class Coulomb(Element):
    """Coulomb's force between two charges, V = constant q1 q2/distance: like ones repel.

    They sit at the bodies' centres of mass, or at points of them. `constant` is 1/(4 pi epsilon_0) of the vacuum.
    """

    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the two bodies, or points of them, that carry charges", such="[a, b]"
    )
    charges: tuple[Node, ...] = holds(
        ListOf(Scalar(), 2, 2), says="both charges in C; like ones repel", such="[q1, q2]"
    )
    constant: Node = holds(Scalar(), 8.9875517923e9, says="1/(4 pi epsilon_0), in N*m^2/C^2", such="8.9875517923e9")


@dataclass(frozen=True)
class Drag(Element):
    """F = -(linear + quadratic |v|) v at a point of a body, v its velocity in inertial space.

    Without `at` it acts at the centre of mass.
    """

    meant: ClassVar[Mapping[str, str]] = {
        "c": "linear (c*v) and quadratic (c*v^2) are the coefficients, 0.5*rho*cw*A of air among the latter",
    }

    on: str = holds(Text(), says="the body that is slowed down", such="bob")
    at: str | None = holds(
        Text(), None, says="the point of it where it acts; its centre of mass if left out", such="bob.tail"
    )
    linear: Node = holds(Scalar("kg/s"), 0, says="force for each m/s of its speed", such="c1")
    quadratic: Node = holds(Scalar("kg/m"), 0, says="force for each (m/s)^2 of its speed", such="c2")


@dataclass(frozen=True)
class Motor(Element):
    """A direct-current motor in a joint: torque = gear constant (voltage - constant gear u) / resistance.

    `constant` is that of the torque (N m/A) and of the induced voltage (V s/rad); the motor turns `gear` times as fast
    as the joint, whose speed is u. Its inductance and own inertia are left out.
    """

    joint: str = holds(Text(), says="the joint that it drives", such="A")
    voltage: Node = holds(Scalar(), keyword=True, says="the voltage, in V", such="12*sin(t)")
    resistance: Node = holds(Scalar(), keyword=True, says="the resistance of its winding, in ohm", such="2")
    constant: Node = holds(Scalar(), keyword=True, says="its constant: N*m for each A, which is V*s/rad", such="0.05")
    gear: Node = holds(Scalar(), 1, keyword=True, says="how many times as fast as the joint the motor turns", such="20")
    freedom: str | None = holds(
        Text(), None, keyword=True, such="J_phi",
        says="which freedom of the joint, by its coordinate or speed, where it has several",
    )


@dataclass(frozen=True)
class Friction(Element):
    """Dry friction (Coulomb) in a joint, from the joint's own reaction.

    A slider (prismatic) is a guide with two sides: mu |F|. With a `length` it has two pads so far apart, on the child,
    symmetric about the joint's point. Each takes its share of force and moment, so the slider may jam. A hinge
    (revolute) is a journal of `radius`: mu radius |F|, with F the force across its axis. With a `length` it has two
    bearings so far apart along the axis. Neglected forces are reported: a couple, or a force along the axis. A
    cylindrical joint has friction along and, with a radius, about its axis; a screw has it on a thread of mean
    `radius`. Planar and point joints have mu |N| against the velocity of the joint's point, N along the normal. A
    planar joint with a `radius` slides on a ring: force F and couple C satisfy sqrt(F^2 + (C/radius)^2) = mu |N|. A
    ball joint (spherical) of `radius` has mu radius |F| against its angular velocity. A universal joint has two pins of
    `radius`, each with the force across it, and a custom joint has a guide or pin for each freedom. `static` may be the
    word `enough`. A missing coefficient equals the other one. A `force` in place of coefficients is a constant friction
    force or moment of a hinge or slider, at rest too. `regularised` is the speed (m/s, at the radius) below which
    friction is smooth; nothing sticks then.
    """

    meant: ClassVar[Mapping[str, str]] = {
        "on": "a joint rubs: joint: NAME; where bodies touch, their contact has static and kinetic",
        "mu": "static",
    }

    joint: str = holds(Text(), says="the joint that rubs", such="guide")
    static: Coefficient | None = holds(
        CoefficientField(), None, such="0.4",
        says="coefficient of friction at rest, or enough: it never slips; the kinetic one if left out",
    )
    kinetic: Node | None = holds(
        KineticField(""), None, says="coefficient of friction while it moves; the static one if left out", such="0.3"
    )
    radius: Node | None = holds(
        Scalar("m"), None, says="radius of the journal, pin, thread, ring or ball on which it rubs", such="20 mm"
    )
    length: Node | None = holds(
        Scalar("m"), None, says="distance of the two pads of a slider, or of the two bearings of a hinge", such="0.2 m"
    )
    regularised: Node | None = holds(
        Scalar("m/s"), None, says="speed below which friction is smooth, so that nothing sticks", such="1 mm/s"
    )
    force: Node | None = holds(
        Scalar(), None, says="constant friction in place of coefficients: a force, in a hinge a moment", such="2 N*m"
    )

    def units(self, speed: str = "m/s") -> Mapping[str, str]:
        """Return the units of the fields in a joint whose speed has the unit `speed`."""
        return {"force": effort_unit(speed)}

    def verify(self) -> None:
        if self.force is not None:
            others = "static", "kinetic", "radius", "length", "regularised"
            beside = [name for name in others if getattr(self, name) is not None]
            if beside:
                message = "a constant force has no coefficients, no radius or length, and is not smooth"
                raise ModelError(message, number="M110").under(beside[0])
            if self.force.shadow is not None and self.force.shadow < 0.0:
                raise ModelError("friction is not negative", number="M109").under("force")
            return
        if self.static is None and self.kinetic is None:
            raise ModelError("friction needs a coefficient: static, kinetic or both", number="M102").under("static")
        if isinstance(self.static, str) and self.regularised is not None:
            message = "what never slips (static: enough) is not smooth either: leave out regularised"
            raise ModelError(message, number="M110").under("regularised")
        for name in ("static", "kinetic"):
            if (constant_of(getattr(self, name)) or 0.0) < 0.0:
                raise ModelError("a coefficient of friction is not negative", number="M109").under(name)
        verify_coefficients(self.static, self.kinetic)
        for name in ("radius", "length", "regularised"):
            given = getattr(self, name)
            if given is not None and given.shadow is not None and not given.shadow > 0.0:
                raise ModelError("it must be greater than zero", number="M109").under(name)


def _verify_freedom(freedom: object, joint: object) -> None:
    if freedom is not None and joint is None:
        raise ModelError("freedom goes with joint", number="M110").under("freedom")


def _verify_place(between: object, joint: object) -> None:
    if (between is None) == (joint is None):
        raise ModelError("it acts either between two points (between: [a, b]) or in a joint (joint:)", number="M110")


FORCES: Final = OneOf(
    {
        "force": Force,
        "distributed": Distributed,
        "torque": Torque,
        "spring_damper": SpringDamper,
        "damper": Damper,
        "pull": Pull,
        "potential": Potential,
        "gravitation": Gravitation,
        "coulomb": Coulomb,
        "drag": Drag,
        "motor": Motor,
        "friction": Friction,
    },
    {"spring": "spring_damper"},
    dict.fromkeys(("gravity", "weight"), "gravity: [0, -g, 0], beside the name of the system, acts on all bodies"),
)
