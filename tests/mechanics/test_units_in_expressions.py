"""Units in every expression of a model: coordinates, speeds and time have theirs where parameters were given units."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: units
parameters: {{m: 1 kg, l: 2 m, k: 3 N/m, c: 5 N*s/m, w: 2 rad/s, T: 2 s, J: 2 kg*m^2{parameters}}}
bodies: {{b: {{mass: m, points: {{p: [l, 0, 0]}}}}, d: {{mass: m, inertia: {{Izz: J}}}}}}
joints:
  A: {{type: prismatic, parent: ground, child: b, axis: x, q: s}}
  B: {{type: revolute, parent: ground, child: d, axis: z, q: theta}}
{rest}
"""
FORCE = "forces: {f: {type: force, on: b, value: [%s, 0, 0]}}"


def resolved(rest: str, parameters: str = "") -> None:
    mbs.mechanism(mbs.loads(MODEL.format(rest=rest, parameters=parameters and f", {parameters}")))


@pytest.mark.parametrize(
    ("rest", "place", "told"),
    [
        (FORCE % "s", "forces.f.value.0", "a quantity in m; here one in N"),
        ("forces: {f: {type: potential, joint: A, value: k*s}}", "forces.f.value", "a quantity in N; here one in J"),
        ("forces: {f: {type: potential, on: b, value: k*x}}", "forces.f.value", "a quantity in N; here one in J"),
        ("forces: {f: {type: spring_damper, joint: A, stiffness: k*s}}", "forces.f.stiffness", "here one in N/m"),
        ("outputs: {o: theta + l}", "outputs.o", "theta has no unit"),
        ("outputs: {o: s + u_s}", "outputs.o", "u_s is in m/s, s is in m"),
        ('outputs: {o: "where(s > t, s, l)"}', "outputs.o", "t is in s, s is in m"),
        ("outputs: {o: sin(s)}", "outputs.o", r"sin\(\) wants a pure number or an angle, and s is in m"),
        ("outputs: {o: exp(s/T)}", "outputs.o", r"exp\(\) wants a pure number"),
        ("outputs: {o: s'' + u_s}", "outputs.o", "u_s is in m/s, s'' is in m/s.2"),
        ("ask: {e: fx(A) + l}", "ask.e.value", "a sum of m and N"),
        ("ask: {e: {max: mz(B) + fy(B)}}", "ask.e.max", "a sum of"),
        ("stop: {e: s > T}", "stop.e", "T is in s, s is in m"),
        ("ask: {e: u_s > l}", "ask.e.when", "a comparison"),
        ("ask: {e: {max: s + theta}}", "ask.e.max", "a sum"),
        ("ask: {e: {value: theta, when: {s: 2 s}}}", "ask.e.when.s", "expected a quantity in m"),
        ("ask: {e: {value: theta, when: {s: T}}}", "ask.e.when.s", "in s; here one in m"),
        ("ask: {v: {find: w, so: x == l, between: [1 m, 2 m]}, x: {max: s}}", "ask.v.between.0", "a quantity in rad/s"),
        ("constraints: {r: {type: expression, zero: s - theta}}", "constraints.r.zero", "a sum"),
        ("constraints: {r: {type: velocity, zero: u_s - w*theta}}", "constraints.r.zero", "a sum of m/s and 1/s"),
        ("constraints: {r: {type: motion, joint: A, value: t}}", "constraints.r.value", "in s; here one in m"),
        ("constraints: {r: {type: motion, joint: A, value: 2 s}}", "constraints.r.value", "expected a quantity in m"),
        ("constraints: {r: {type: gear, joints: [A, B], ratio: w}}", "constraints.r", "a sum"),
        ("constraints: {r: {type: coupler, joints: {A: 1, B: l}, value: T}}", "constraints.r", "a sum of m and s"),
        ("constraints: {r: {type: rope, path: [b, ground], length: T}}", "constraints.r.length", "in s; here one in m"),
        ("inputs: {F: {table: [[0 s, 1 N], [1, 2 N]], of: s}}", "inputs.F.table.0", "expected a quantity in m"),
        ("inputs: {F: {table: [[0, 1 N], [1, 2 N]], of: s + theta}}", "inputs.F.of", "a sum"),
    ],
)
def test_a_wrong_unit_is_refused_where_it_stands(rest: str, place: str, told: str) -> None:
    with pytest.raises(mbs.MultibodyError, match=told) as caught:
        resolved(rest)
    assert ".".join(map(str, caught.value.where.path)) == place


def test_all_wrong_units_of_an_expression_are_told_at_once() -> None:
    """What is made of a wrong part, here the product with k and the whole sum, is not told."""
    text = """
multibody_sym: 1
name: block
parameters: {k: 100 N/m, T: 2 s, v: 3 m/s}
bodies: {m: {mass: 1}}
joints: {J: {type: prismatic, axis: x, parent: ground, child: m, q: x}}
forces: {f: {type: force, on: m, value: ["k*(x - T) + sin(v)", 0, 0]}}
"""
    with pytest.raises(mbs.InputError) as raised:
        mbs.solve(mbs.loads(text))
    told = [raised.value, *raised.value.others]
    assert {each.where.path for each in told} == {("forces", "f", "value", "0")}
    assert {each.message for each in told} == {
        "a sum of m and s: x is in m, T is in s", "sin() wants a pure number or an angle, and v is in m/s"
    }  # fmt: skip


def test_names_of_expressions_have_the_units_of_these() -> None:
    with pytest.raises(mbs.MultibodyError, match="a quantity in m/s; here one in N"):
        resolved(FORCE % "speed", "speed: l/T")
    with pytest.raises(mbs.MultibodyError, match="a quantity in N/m; here one in N"):
        resolved(f"inputs: {{F: k*theta}}\n{FORCE % 'F'}")
    with pytest.raises(mbs.MultibodyError, match="a quantity in m; here one in s"):
        resolved("", "wrong: {value: l, dimension: s}")


@pytest.mark.parametrize(
    "rest",
    [
        FORCE % "5*sin(3*t) - 5*s - 0.1*u_s*abs(u_s)",
        FORCE % "-k*s - c*u_s - 2*u_s^2",
        "outputs: {a: l + s*cos(theta), b: u_s*T + s, h: exp(-t/T), d: sin(t), e: 9.81*t + s, f: 1 + l}",
        "outputs: {a: theta''*l + s'', b: fx(A) - k*s - 3*s'', o: mz(A) + l*fx(B), d: fx(A) + 5*s, e: s'^2 + u_s*l/T}",
        "stop: {a: s > 2, b: theta > pi, c: t > T, d: u_s < 0 and s > l}",
        "ask: {a: {s: 2}, b: {s: 2 m}, c: {value: s, when: {theta: 30 deg}}}",
        "forces: {f: {type: potential, joint: A, value: k*s^2/2 + 3*s}}",
        "constraints: {r: {type: expression, zero: s - 0.5*theta}}",
        "constraints: {r: {type: motion, joint: A, value: 2*t}}",
        "inputs: {F: k*l*sin(w*t)}\n" + FORCE % "F",
    ],
)
def test_a_plain_number_may_carry_a_unit_that_nobody_wrote(rest: str) -> None:
    resolved(rest)


def test_motion_has_no_units_in_a_model_without_units() -> None:
    text = MODEL.format(rest=FORCE % "s + theta + u_s*t", parameters="")
    for unit in (" kg*m^2", " kg", " N/m", " N*s/m", " m", " rad/s", " s"):
        text = text.replace(f"2{unit}", "2").replace(f"1{unit}", "1").replace(f"3{unit}", "3").replace(f"5{unit}", "5")
    mbs.mechanism(mbs.loads(text))


TOUCHING = """
multibody_sym: 1
name: touching
parameters: {m: 1 kg, J: 1 kg*m^2, l: 1 m, mu: 0.3}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  b: {mass: m}
  d: {mass: m, inertia: {Izz: J}}
joints:
  A: {type: prismatic, parent: ground, child: b, axis: y, q: y, limits: {lower: 0 m}}
  B: {type: revolute, parent: ground, child: d, axis: z, q: theta, limits: {upper: 1 rad}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
outputs: {o: %s}
"""


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("normal(c) + m", "normal(c) + fx(A)"),
        ("friction(c) - l", "friction(c) - mu*normal(c)"),
        ("force(A.lower) + force(B.upper)", "force(A.lower)*l + force(B.upper)"),
    ],
)
def test_what_touches_and_stops_exert_has_units(wrong: str, right: str) -> None:
    mbs.mechanism(mbs.loads(TOUCHING % right))
    with pytest.raises(mbs.MultibodyError, match="a sum of"):
        mbs.mechanism(mbs.loads(TOUCHING % wrong))
