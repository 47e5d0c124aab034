"""Curves as they are declared: forms, units, names, what is refused with which words, what is written back."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import pytest

import multibody_sym as mbs

WIRE = """
multibody_sym: 1
name: wire
parameters: {{p: 2 m, m: 1 kg}}
bodies: {{bead: {{mass: m}}}}
joints:
  wire:
    type: curve
    parent: ground
    child: bead
    curve: {curve}
    initial: {{q: {q}}}
"""


def wire(curve: str, q: str = "1") -> mbs.System:
    return mbs.loads(WIRE.format(curve=curve, q=q))


@pytest.mark.parametrize(
    ("curve", "unit", "names"),
    [
        ("{y: x^2/(2*p)}", "m", ["x", "y"]),
        ("{x: y^2/p}", "m", ["x", "y"]),
        ("{z: sin(x/p)*p, y: x}", "m", ["x", "y", "z"]),
        ("{x: p*cos(s), y: p*sin(s), parameter: s}", "rad", ["x", "y"]),
        ("{x: s, y: s^2/p, parameter: s}", "m", ["x", "y"]),
        ("{x: p*cos(s/p), y: p*sin(s/p), parameter: s, unit: m}", "m", ["x", "y"]),
    ],
)
def test_forms_and_units(curve: str, unit: str, names: list[str]) -> None:
    system = wire(curve)
    resolved = mbs.mechanism(system)
    assert resolved.coordinates[0].unit == unit
    moved = [axis for axis, way in zip("xyz", resolved.bodies[0].steps[0].rates.s, strict=True) if way.shadow != 0]
    assert moved == names
    assert mbs.loads(mbs.dumps(system)) == system
    assert pickle.loads(pickle.dumps(system)) == system == copy.deepcopy(system)


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        ("{}", "say where the curve leads"),
        ("{x: s, y: s^2/p, z: s}", "say where the curve leads"),
        ("{y: x^2/p, parameter: s}", "no coordinate of the curve names 's'"),
        ("{y: abs(x)}", "has a kink or a jump"),
        ('{y: "where(x < 0, x, 2*x)"}', "has a kink or a jump"),
        ("{y: k*x}", "'k' is not declared"),
        ("{y: u_wire*x}", "here an expression names parameters, inputs, the time only"),
        ("{x: m, y: m^2/p, parameter: m}", "'m' is a parameter of the model and the parameter of this curve"),
        ("{y: x^2/p, unit: kg}", "'kg' is no choice here"),
        ("{y: p^2}", "a quantity in m\\^2; here one in m is wanted"),
    ],
)
def test_what_is_refused_is_told_at_its_place(curve: str, words: str) -> None:
    with pytest.raises(mbs.ModelError, match=words) as found:
        mbs.mechanism(wire(curve))
    where = found.value.where  # what only the whole model tells has its line from the commands
    assert where.line == 11 or tuple(where.path)[:3] == ("joints", "wire", "curve")


@pytest.mark.parametrize(
    ("curve", "q", "words"),
    [
        ("{x: p*(s - sin(s)), y: p*cos(s), parameter: s}", "0", r"cusp, or stops, at s = 0 rad, .* from \(0, 2, 0\) m"),
        ("{y: p*log(x/p)}", "-1", "no finite value at the start"),
    ],
)
def test_a_start_without_a_way_is_told(curve: str, q: str, words: str) -> None:
    with pytest.raises(mbs.ModelError, match=words):
        mbs.solve(wire(curve, q))


def test_a_coordinate_may_have_the_name_of_the_parameter() -> None:
    s, (p,) = mbs.variable("s"), mbs.parameters("p", [2])
    circle = mbs.Curve(x=p * mbs.sin(s), y=-p * mbs.cos(s), parameter="s")
    system = mbs.System(
        "wire",
        gravity=[0, -9.81, 0],
        bodies={"bead": mbs.Body(mass=1)},
        joints={"wire": mbs.CurveJoint(parent="ground", child="bead", curve=circle, q="s")},
        outputs={"height": -p * mbs.cos(s)},
    )
    assert mbs.loads(mbs.dumps(system)) == system
    pendulum = mbs.solve(system, initial={"s": 0.5}).accelerations["s"].value
    assert pendulum == pytest.approx(-9.81 / 2 * math.sin(0.5), rel=1e-14)


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ({"curve": {"y": "x^2", "z": "x"}}, "lies in the x-y plane of its body"),
        ({"outline": {"x": "cos(s)", "y": "sin(s)", "parameter": "s"}, "side": "right"}, "touched from outside"),
        ({"curve": {"y": "x^2"}, "disc": 1}, "a surface is one of"),
    ],
)
def test_surfaces_that_are_no_curves(surface: dict[str, Any], words: str) -> None:
    with pytest.raises(mbs.ModelError, match=words):
        mbs.Surface(**surface)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (mbs.Body(shape=mbs.Shape("box", [1, 1, 1], 1)), "corner1, corner2, corner3, corner4; give each a contact"),
        (mbs.Body(mass=1, surfaces={"drum": mbs.Surface(disc=1, inside=True)}), "a curve is touched by points, discs"),
    ],
)
def test_what_cannot_touch_a_curve(body: mbs.Body, words: str) -> None:
    hill = mbs.Body(surfaces={"hill": mbs.Surface(curve=mbs.Curve(y="x^2"))})
    system = mbs.System(
        "hill",
        bodies={"ground": hill, "b": body},
        joints={"free": mbs.Planar("ground", "b")},
        contacts={"c": mbs.Contact(("b", "ground.hill"))},
    )
    with pytest.raises(mbs.ModelError, match=words):
        mbs.mechanism(system)


@pytest.mark.parametrize(
    ("point", "on", "curve", "words", "path"),
    [
        ("rod.edn", "ground", "p*s", "'rod' has no point or frame 'edn'", "constraints.c.point"),
        ("rod", "grund", "p*s", "no body is called 'grund'; did you mean ground", "constraints.c.on"),
        ("rod", "ground.b", "p*s", "'ground' has no point or frame 'b'", "constraints.c.on"),
        ("rod", "ground", "k*s", "'k' is not declared", "constraints.c.curve.x"),
        ("rod", "ground", "free_x*s", "'free_x' is a coordinate; here an expression names", "constraints.c.curve.x"),
    ],
)
def test_wrong_guides_of_points_are_told_where_they_stand(
    point: str, on: str, curve: str, words: str, path: str
) -> None:
    system = mbs.System(
        "guided",
        parameters={"p": 1},
        bodies={"rod": mbs.Body(shape=mbs.Shape("rod", 1, 1))},
        joints={"free": mbs.Planar("ground", "rod")},
        constraints={"c": mbs.OnCurve(point, mbs.Curve(x=curve, y="s^2", parameter="s"), on)},
    )
    with pytest.raises(mbs.ModelError, match=words) as found:
        mbs.mechanism(system)
    assert ".".join(found.value.where.path) == path


@pytest.mark.parametrize(
    ("curve", "place"),
    [("{y: m*x^2}", "y"), ("{y: p*x^2}", "y"), ("{x: m*s, y: p*cos(s), parameter: s}", "x"), ("{y: x^2/2 + m*x}", "y")],
)
def test_terms_of_a_curve_are_lengths(curve: str, place: str) -> None:
    with pytest.raises(mbs.ModelError, match="here one in m is wanted") as found:
        mbs.mechanism(wire(curve))
    assert ".".join(found.value.where.path) == f"joints.wire.curve.{place}"


@pytest.mark.parametrize("curve", ["{y: x^2/2 + x^2/p}", "{x: s, y: cos(s), parameter: s}", "{y: p*cosh(x/p)}"])
def test_numbers_in_curves_may_have_units_that_nobody_wrote(curve: str) -> None:
    assert mbs.mechanism(wire(curve, "0.1")).name == "wire"
