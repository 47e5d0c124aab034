"""The expression language, from the tables of its parser: functions, units, quantities, states."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from multibody_sym.model.state_words import VERBS
from multibody_sym.scalars.functions import evaluate
from multibody_sym.text.parser import FUNCTIONS, QUANTITIES
from multibody_sym.text.tokens import LARGEST_EXPONENT, LONGEST_NAME, LONGEST_TEXT, MOST_DIGITS, MOST_TOKENS
from multibody_sym.text.units import UNITS
from site_pages.markdown import block, code, table

FUNCTIONS_SAY: Final = {
    "sin": "sine of an angle in rad",
    "cos": "cosine of an angle in rad",
    "tan": "tangent of an angle in rad",
    "asin": "angle in rad from -pi/2 to pi/2 whose sine is x",
    "acos": "angle in rad from 0 to pi whose cosine is x",
    "atan": "angle in rad from -pi/2 to pi/2 whose tangent is x",
    "atan2": "angle in rad from -pi to pi of the direction (x, y)",
    "sinh": "hyperbolic sine",
    "cosh": "hyperbolic cosine",
    "tanh": "hyperbolic tangent",
    "asinh": "inverse hyperbolic sine",
    "acosh": "inverse hyperbolic cosine",
    "atanh": "inverse hyperbolic tangent",
    "exp": "e to the power of x",
    "log": "natural logarithm",
    "sqrt": "square root",
    "abs": "absolute value",
    "sign": "-1, 0 or 1",
    "min": "the least of its arguments",
    "max": "the largest of its arguments",
    "where": "a where the condition holds, else b",
}
QUANTITIES_SAY: Final = {
    "position": "where a point is, along x, y or z of ground",
    "velocity": "how fast a point is, along x, y or z",
    "acceleration": "the acceleration of a point, along x, y or z",
    "angular_velocity": "how fast a body turns, about x, y or z",
    "angular_acceleration": "its rate",
    "rotation": "the component of an axis of a body or frame along one of ground; `rotation(arm, x, z)`: its z along x",
    "quaternion": "w, x, y or z of the unit quaternion of a body or frame, with w >= 0",
    "angle": "how far a body or frame has turned about an axis of ground, from -pi to pi: about z its x-axis",
    "distance": "how far apart two points are",
    "'": "the rate of a coordinate or of a speed",
    "''": "the second derivative of a coordinate",
    "reaction": "one of the forces below, such as `fx(hinge)`",
    "tension": "the tension of a rope or rod; of a rope with several tensions by number along its path",
    "multiplier": "the multiplier of a constraint, or of a row of a cut joint",
    "total_energy": "kinetic and potential energy",
    "kinetic_energy": "kinetic energy, of all or of a body",
    "potential_energy": "potential energy, of all, of a body's weight or of a force",
    "jacobi_integral": "what is conserved instead of the energy where ground moves or coordinates are driven evenly",
    "center_of_mass": "where the common centre of mass is, along x, y or z",
    "momentum": "momentum, of all or of a body, along x, y or z",
    "angular_momentum": "angular momentum, of all or of a body, about the origin or a point, along x, y or z",
    "generalized_momentum": "the momentum that belongs to a coordinate or speed",
    "power": "the power of a force, constraint, contact, joint or of the weight",
    "work": "its work since the start of the run",
    "impulse": "its impulse since the start of the run, along x, y or z, on all or on a body",
    "frequency": "the angular frequency of a mode of small oscillations, by number",
    "period": "the period of a mode, by number",
}
_OPERATORS: Final = (
    ("`+ -`", "sum, difference, sign"),
    ("`* /`", "product, quotient; a product is always written with `*`"),
    ("`^` or `**`", "power; it binds strongest, and `2^3^2` is `2^(3^2)`"),
    ("`< <= > >=`", "comparison; they do not chain"),
    ("`and or`", "join conditions; `and` binds stronger"),
    ("`( )`", "parentheses"),
    ("`.`", "joins names: `rod.pin`; a name with blanks is quoted: `'my rod'.pin`"),
)
_CONSTANTS: Final = (("`pi`", "3.14159.."), ("`t`", "the time in s"), ("`real(x)`", "a decimal as the float it is"))
_FORCES: Final = (
    ("`fx(joint)` .. `fz(joint)`", "force of a joint, or of what holds a pulley, on its child", "`N`"),
    ("`mx(joint)` .. `mz(joint)`", "moment of a joint on its child, about the joint's point", "`N*m`"),
    ("`normal(contact)`", "normal force of a contact, of one corner (`box.corner1`) or of all", "`N`"),
    ("`friction(contact)`",
     "friction of a contact; in space its length, and `friction_1`, `friction_2` along the tangents", "`N`"),
    ("`rolling(contact)`", "moment of rolling resistance; in space its length, and `rolling_1`, `rolling_2`", "`N*m`"),
    ("`at_x(contact)` .. `at_z(contact)`",
     "where the normal force of a contact acts; where none presses, the middle of its points", "`m`"),
    ("`force(joint.lower)`", "force of a stop, `lower` or `upper`", "by what is asked"),
    ("`friction(name)`, `normal(name)`", "friction in a joint and what presses there; of parts by name, `rub.pad1`",
     "by what is asked"),
    ("`normal(joint)`", "force across the curve along which a joint guides", "`N`"),
)


def language() -> str:
    """Return the sections about expressions."""
    functions = [(code(f"{name}({', '.join(args)})"), FUNCTIONS_SAY[name]) for name, args in FUNCTIONS.items()]
    quantities = [(_calls(name), QUANTITIES_SAY[name], _dimension(name)) for name in QUANTITIES]
    units = [(code(name), str(dimension) or "", _factor(name)) for name, (_, dimension) in UNITS.items()]
    states = [(code(f"NAME {verb}"), ", ".join(map(code, words))) for verb, words in VERBS.items()]
    such = 'value: m*g*sin(alpha)\ncom: [l/2, "atan2(y, x)", 0]\nl: 500 mm\nw: 2*pi*f'
    return f"""\
## Expressions

Wherever a number stands, an expression may stand. Names are those of parameters, coordinates, speeds (`u_` and the
coordinate) and inputs of the model, and `t`. Inside `[..]` or `{{..}}` an expression with a comma is quoted.

{block(such, "yaml")}
### Operators

{table(("operator", "meaning"), _OPERATORS)}
### Functions

{table(("function", "value"), functions)}
### Constants

{table(("name", "value"), _CONSTANTS)}
### Quantities

In `outputs`, `stop` and `ask` expressions name what the motion does.

{table(("quantity", "value", "SI unit"), quantities)}
### Forces

Each force has a name of its own, and this name is printed: `fx(hinge)`, `normal(c)`, `tension(rope, 2)`.
`reaction(hinge, fx)` means the same.

{table(("force", "value", "SI unit"), _FORCES)}
### States

In `stop` and `ask`, and as moments, the beginning of a state is a condition: `c1 sticks`. A state that is there from
the start begins when it comes back. States are not joined by `and` and `or`. A contact with several parts, as that of a
box on a plane, has no state of its own: its parts have, `c1.corner1 opens`. The error about `c1 opens` lists them.

{table(("condition", "states in which it holds"), states)}
### Units

A number with a unit is converted to SI when it is read: `9.81 m/s^2`, `200 g`, `1200 rpm`, `5 N*m`. Units are joined by
`*`, `/` and `^`. A unit stands behind one number, never behind an expression.

{table(("unit", "of the dimension of", "in SI"), units)}
### Limits of expressions

At most {LONGEST_TEXT:,} characters, {MOST_TOKENS:,} numbers, names and operators, names of {LONGEST_NAME} letters,
numbers of {MOST_DIGITS} digits and exponents of {LARGEST_EXPONENT}. Nothing in an expression is ever run as code.
"""


def _calls(name: str) -> str:
    asked = QUANTITIES[name]
    if name.startswith("'"):
        return code(f"{asked.arguments[0]}{name}")
    return ", ".join(code(f"{name}({', '.join(args)})") for args in (asked.arguments, *asked.others))


def _dimension(name: str) -> str:
    dimension = QUANTITIES[name].dimension
    return "by what is asked" if dimension is None else code(str(dimension))


def _factor(name: str) -> str:
    factor = UNITS[name][0]
    if factor.op == "number":
        return f"{float(Fraction(factor.data)):.10g}"
    return f"{float(evaluate([factor], lambda leaf: leaf)[0].shadow or 0.0):.10g}"
