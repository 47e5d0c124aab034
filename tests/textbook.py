"""Small systems of textbooks, with symbolic parameters; each has the coordinates that books choose."""

from __future__ import annotations

from collections.abc import Iterable

from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Expression
from multibody_sym.model.forces import Force, SpringDamper
from multibody_sym.model.joints import Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System

DOWN = [0, "-g", 0]


def positive(names: str, value: float = 1) -> dict[str, Parameter]:
    """Return positive parameters, and g."""
    listed = {name: Parameter(value=value, positive=True) for name in names.split()}
    return {**listed, "g": Parameter(value=9.81, positive=True)}


def pendulum(L: str = "l", m: str = "m", q: str = "theta") -> System:
    return System(
        "pendulum",
        gravity=DOWN,
        parameters=positive(f"{m} {L}"),
        bodies={"bob": Body(mass=m, com=[0, f"-{L}", 0])},
        joints={"hinge": Revolute("ground", "bob", axis="z", q=q)},
    )


def cart_pole() -> System:
    """A pole that hangs down from a cart, pushed by F."""
    return System(
        "cart_pole",
        gravity=DOWN,
        parameters=positive("M m l"),
        bodies={"cart": Body(mass="M"), "bob": Body(mass="m", com=[0, "-l", 0])},
        joints={
            "rail": Prismatic("ground", "cart", axis="x", q="x"),
            "hinge": Revolute("cart", "bob", axis="z", q="theta"),
        },
        inputs={"F": "sin(t)"},
        forces={"push": Force(on="cart", value=["F", 0, 0])},
    )


def elastic_pendulum() -> System:
    return System(
        "elastic_pendulum",
        gravity=DOWN,
        parameters=positive("m k r0 c"),
        bodies={"arm": Body(), "bob": Body(mass="m")},
        joints={
            "hinge": Revolute("ground", "arm", axis="z", q="theta"),
            "slide": Prismatic("arm", "bob", axis="-y", q="r", initial={"q": 1}),
        },
        forces={"spring": SpringDamper(joint="slide", stiffness="k", length="r0", damping="c")},
    )


def chain(masses: Iterable[str], lengths: Iterable[str]) -> System:
    """Point masses one below the other, angles relative: a pendulum, double pendulum, triple pendulum."""
    pairs = list(zip(masses, lengths, strict=True))
    bodies, joints = {}, {}
    for k, (m, L) in enumerate(pairs, 1):
        bodies[f"bob{k}"] = Body(mass=m, com=[0, f"-{L}", 0], points={"end": [0, f"-{L}", 0]})
        parent = "ground" if k == 1 else f"bob{k - 1}.end"
        joints[f"hinge{k}"] = Revolute(parent, f"bob{k}", axis="z", q=f"q{k}")
    names = " ".join(name for pair in pairs for name in pair)
    return System("chain", gravity=DOWN, parameters=positive(names), bodies=bodies, joints=joints)


def double_pendulum() -> System:
    return chain(["m1", "m2"], ["l1", "l2"])


def spherical_pendulum() -> System:
    return System(
        "spherical_pendulum",
        gravity=[0, 0, "-g"],
        parameters=positive("m l"),
        bodies={"yoke": Body(), "bob": Body(mass="m", com=[0, 0, "-l"])},
        joints={
            "post": Revolute("ground", "yoke", axis="z", q="phi"),
            "pin": Revolute("yoke", "bob", axis="x", q="theta"),
        },
    )


def top() -> System:
    """A heavy top on a ball joint; A, B, C are its principal moments about the centre of mass."""
    return System(
        "top",
        gravity=[0, 0, "-g"],
        parameters=positive("m l A B C"),
        bodies={"top": Body(mass="m", com=[0, 0, "l"], inertia={"Ixx": "A", "Iyy": "B", "Izz": "C"})},
        joints={"ball": Spherical("ground", "top")},
    )


def hanging_mass() -> System:
    """A mass on a vertical rod, y downward positive is not: it hangs at y = -l."""
    return System(
        "hanging_mass",
        gravity=DOWN,
        parameters=positive("m l"),
        bodies={"bob": Body(mass="m")},
        joints={"fall": Prismatic("ground", "bob", axis="y", q="y", initial={"q": -1})},
        constraints={"rod": Distance(between=["ground", "bob"], value="l")},
    )


def pendulum_in_xy() -> System:
    """A pendulum in x and y, held by a rod."""
    return System(
        "pendulum_in_xy",
        gravity=DOWN,
        parameters=positive("m l"),
        bodies={"bob": Body(mass="m", inertia={"Izz": "m*l^2"})},
        joints={"free": Planar("ground", "bob", q=["x", "y", "phi"], initial={"q": [0, -1, 0]})},
        constraints={"rod": Distance(between=["ground", "bob"], value="l"), "still": Expression("phi")},
    )
