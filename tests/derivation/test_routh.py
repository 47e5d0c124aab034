"""Routh's reduction against books' effective potentials, and against Lagrange's equations with the speeds put back."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from textbook import DOWN, cart_pole, double_pendulum, pendulum, positive, spherical_pendulum

import multibody_sym as mbs
from multibody_sym.derivation.canonical import Reduction, cyclic_speeds, energy_terms, reduce_energies
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.scalars.functions import cos, evaluate_float, sin
from multibody_sym.scalars.node import Node, as_node, slot


def turning_hoop(driven: bool) -> mbs.System:
    """A bead on a hoop of inertia J that turns about its vertical diameter freely, or with the angle w t."""
    turning = {"motion": "w*t"} if driven else {}
    return mbs.System(
        "hoop",
        gravity=[0, 0, "-g"],
        parameters=positive("m R J w", 1.5),
        bodies={"hoop": mbs.Body(mass=0, inertia={"Izz": "J"}), "bead": mbs.Body(mass="m", com=[0, 0, "-R"])},
        joints={
            "axle": mbs.Revolute("ground", "hoop", axis="z", q=None if driven else "phi", **turning),
            "wire": mbs.Revolute("hoop", "bead", axis="x", q="theta"),
        },
    )


def by_name(mechanism: Mechanism) -> dict[str, Node]:
    return {name.data: node for name, node in mechanism.symbols.items()}


def value(mechanism: Mechanism, node: object, given: Mapping[Node, float]) -> float:
    rest = {slot("parameters", k): 0.3 + 0.17 * k for k in range(len(mechanism.parameters))}
    rest.update({slot("q", k): 0.4 + 0.31 * k for k in range(len(mechanism.coordinates))})
    rest.update({slot("u", k): 0.7 - 0.23 * k for k in range(len(mechanism.speeds))})
    return float(evaluate_float([as_node(node)], {**rest, **given})[0])


P = slot("momenta", 0)


def reduction(system: mbs.System) -> tuple[Mechanism, Reduction]:
    mechanism = mbs.mechanism(system)
    return mechanism, reduce_energies(energy_terms(mechanism), cyclic_speeds(mechanism), [P])


def test_effective_potential_of_the_spherical_pendulum() -> None:
    mechanism, found = reduction(spherical_pendulum())
    assert [mechanism.speeds[k].name for k in found.replaced] == ["u_phi"]
    m, l, g, theta = (by_name(mechanism)[x] for x in ("m", "l", "g", "theta"))
    book = P * P / (2 * m * l * l * sin(theta) * sin(theta)) - m * g * l * cos(theta)
    given = {P: 0.83}
    assert value(mechanism, found.potential, given) == pytest.approx(value(mechanism, book, given), rel=1e-13)
    assert value(mechanism, found.mass_matrix[0][0], given) == pytest.approx(value(mechanism, m * l * l, given))
    speed = P / (m * l * l * sin(theta) * sin(theta))
    (phi_rate,) = found.replaced_speeds([slot("u", k) for k in found.kept])
    assert value(mechanism, phi_rate, given) == pytest.approx(value(mechanism, speed, given), rel=1e-13)


def test_bead_on_a_free_hoop() -> None:
    mechanism, found = reduction(turning_hoop(driven=False))
    names = by_name(mechanism)
    m, R, J, g, theta = (names[x] for x in ("m", "R", "J", "g", "theta"))
    book = P * P / (2 * (J + m * R * R * sin(theta) * sin(theta))) - m * g * R * cos(theta)
    given = {P: -1.1}
    assert value(mechanism, found.potential, given) == pytest.approx(value(mechanism, book, given), rel=1e-13)


def test_bead_on_a_driven_hoop_has_no_cyclic_coordinate_but_an_effective_potential() -> None:
    mechanism = mbs.mechanism(turning_hoop(driven=True))
    assert cyclic_speeds(mechanism) == ()
    terms = energy_terms(mechanism)
    m, R, J, w, g, theta = (by_name(mechanism)[x] for x in ("m", "R", "J", "w", "g", "theta"))
    book = -m * g * R * cos(theta) - w * w * (J + m * R * R * sin(theta) * sin(theta)) / 2
    found = reduce_energies(terms, (), ())
    assert value(mechanism, found.potential, {}) == pytest.approx(value(mechanism, book, {}), rel=1e-13)


def test_what_is_pushed_is_not_cyclic() -> None:
    assert cyclic_speeds(mbs.mechanism(cart_pole())) == ()
    assert cyclic_speeds(mbs.mechanism(pendulum())) == ()


def test_coordinates_that_drop_out_by_trigonometry_are_cyclic() -> None:
    """The length of a spring to the pivot of a double pendulum depends on the inner angle in form alone."""
    whole = double_pendulum()
    spring = mbs.SpringDamper(between=["ground", list(whole.bodies)[1]], stiffness=3, length=0.2)
    floating = mbs.System(
        "floating",
        gravity=[0, 0, 0],
        parameters=whole.parameters,
        bodies=whole.bodies,
        joints=whole.joints,
        forces={"spring": spring},
    )
    mechanism = mbs.mechanism(floating)
    assert [mechanism.speeds[k].name for k in cyclic_speeds(mechanism)] == ["u_q1"]


def test_replacing_all_speeds_gives_the_energy() -> None:
    """H(q, p) at p = M u + b is T2 - T0 + V."""
    mechanism = mbs.mechanism(double_pendulum())
    terms = energy_terms(mechanism)
    u = [slot("u", k) for k in range(2)]
    p = [terms.mass_matrix[k][0] * u[0] + terms.mass_matrix[k][1] * u[1] + terms.linear[k] for k in range(2)]
    found = reduce_energies(terms, (0, 1), p)
    kinetic = sum(p[k] * u[k] for k in range(2)) / 2
    assert value(mechanism, found.potential, {}) == pytest.approx(
        value(mechanism, kinetic + terms.potential, {}), rel=1e-13
    )
    speeds = [value(mechanism, x, {}) for x in found.replaced_speeds([])]
    assert speeds == pytest.approx([value(mechanism, x, {}) for x in u], rel=1e-13)


def test_gyroscopic_term_of_a_spinning_wheel_on_a_pendulum() -> None:
    """A heavy wheel in a gimbal: the reduction leaves g = p times the cosine of the outer frame's tilt."""
    system = mbs.System(
        "gimbal",
        gravity=DOWN,
        parameters=positive("A C"),
        bodies={
            "outer": mbs.Body(),
            "inner": mbs.Body(),
            "wheel": mbs.Body(inertia={"Ixx": "A", "Iyy": "A", "Izz": "C"}),
        },
        joints={
            "a": mbs.Revolute("ground", "outer", axis="z", q="psi"),
            "b": mbs.Revolute("outer", "inner", axis="x", q="theta"),
            "c": mbs.Revolute("inner", "wheel", axis="z", q="phi"),
        },
    )
    mechanism = mbs.mechanism(system)
    names = by_name(mechanism)
    found = reduce_energies(energy_terms(mechanism), [2], [P])
    expected = [P * cos(names["theta"]), as_node(0)]
    for x, y in zip(found.linear, expected, strict=True):
        assert value(mechanism, x, {P: 0.6}) == pytest.approx(value(mechanism, y, {P: 0.6}), abs=1e-14)
    assert {mechanism.speeds[k].name for k in cyclic_speeds(mechanism)} == {"u_psi", "u_phi"}
