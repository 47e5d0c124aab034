"""The parser: what texts mean (against Python's own arithmetic), and what the errors say."""

import math
import random
from fractions import Fraction

import pytest

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars import functions as f
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, number, quantity, real, symbol
from multibody_sym.text import tokens
from multibody_sym.text.parser import DEEPEST, FUNCTIONS, QUANTITIES, parse, parse_scalar

a, b, c, x = map(symbol, ("a", "b", "c", "x"))
VALUES = {"a": 0.7, "b": -1.3, "c": 2.1, "x": 0.4}


def refusal(text: str) -> ExpressionError:
    with pytest.raises(ExpressionError) as caught:
        parse(text)
    return caught.value


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("1e3", number(1000)), (".5", number(Fraction(1, 2))), ("2.", number(2)), ("012", number(12)),
        ("0.1", number(Fraction(1, 10))), ("1E-3", number(Fraction(1, 1000))), ("1/3", number(Fraction(1, 3))),
        ("pi", PI), ("t", symbol("t")), ("E", symbol("E")), ("lambda", symbol("lambda")), ("sin", symbol("sin")),
        ("-a^2", -(a**2)), ("(-a)^2", a**2), ("2^-x", 2 ** (-x)), ("a^b^c", a ** (b**c)), ("a**b", a**b),
        ("a - b - c", (a - b) - c), ("a/b/c", (a / b) / c), ("a/b*c", (a / b) * c), ("a/-b*c", (a / -b) * c),
        ("-a*b", -(a * b)), ("- - a", a), ("+a", a), ("a*-b", -(a * b)), ("2^-x^2*b", 2 ** (-(x**2)) * b),
        ("a < b + c", a < b + c), ("a >= b", b <= a), ("where(x > 0, a, b)", f.where(x > 0, a, b)),
        ("min(a, b, c)", f.minimum(f.minimum(a, b), c)), ("atan2(a, b)", f.atan2(a, b)), ("abs(a)", f.absolute(a)),
        ("a < b and x > 0", f.minimum(a < b, x > 0)), ("a < b or x > 0", f.maximum(a < b, x > 0)),
        ("a < b or x > 0 and b <= c", f.maximum(a < b, f.minimum(x > 0, b <= c))),
        ("(a < b or x > 0) and b <= c", f.minimum(f.maximum(a < b, x > 0), b <= c)),
        ("a + 1 < b and x > 0 and c < 2", f.minimum(f.minimum(a + 1 < b, x > 0), c < 2)),
        ("where(a < b and x > 0, a, b)", f.where(f.minimum(a < b, x > 0), a, b)),
        ("real(0.1)", real(0.1)), ("real(-2.5e3)", real(-2500.0)),
        ("total_energy()", quantity("total_energy", ())),
        ("reaction(C, fx)", quantity("reaction", ("C", "fx"))),
        ("position(rod.pin, x)", quantity("position", ("rod.pin", "x"))),
        ("position('my rod'.pin, x)", quantity("position", ("my rod.pin", "x"))),
        ("position(\"the \"\"rod\"\"\".'it''s', x)", quantity("position", ("the \"rod\".it's", "x"))),
        ("2*\n a", 2 * a),
    ],
)
def test_meaning(text, meaning):
    assert parse(text) is meaning


def test_decimals_are_exact():
    assert parse("0.1 + 0.2") is number(Fraction(3, 10))
    assert parse("123456789012345678901234567890") is number(123456789012345678901234567890)


def random_text(rng: random.Random, depth: int) -> str:
    """Return an expression that Python and the parser both read."""
    if depth == 0:
        return rng.choice(["a", "b", "c", "x", "2", "0.5", "1e1", ".25"])
    left, right = random_text(rng, depth - 1), random_text(rng, rng.randrange(depth))
    blank = rng.choice(["", " "])
    return rng.choice([
        f"{left}{blank}+{blank}{right}", f"{left}{blank}-{blank}{right}", f"{left}{blank}*{blank}{right}",
        f"{left}{blank}/{blank}{right}", f"({left})", f"{left} - ({right})", f"{left}/({right})", f"-({left})",
        f"sin({left})", f"cosh({right})", f"atan2({left},{blank}{right})", f"({left})**2", f"2**-({right})",
        f"min({left}, {right}, a)", f"abs({left})**0.5",
    ])


def test_values_agree_with_python():
    rng = random.Random(1)
    python = {name: getattr(math, name) for name in ("sin", "cosh", "atan2")} | {"min": min, "abs": abs} | VALUES
    compared = 0
    for _ in range(600):
        text = random_text(rng, rng.randrange(1, 5))
        try:
            expected = eval(text, {"__builtins__": {}}, python)  # the generator's own text
        except (OverflowError, ZeroDivisionError):
            continue
        if isinstance(expected, complex) or not 1e-6 < abs(expected) < 1e6:
            continue
        node = parse(text)
        (value,) = evaluate_float([node], {leaf: VALUES[leaf.data] for leaf in leaves([node], "symbol")})
        assert value == pytest.approx(expected, rel=1e-9), text
        compared += 1
    assert compared > 300


@pytest.mark.parametrize(
    ("text", "column", "part"),
    [
        ("", 1, "an expression is missing"),
        ("  ", 1, "an expression is missing"),
        ("6 kg", 3, "6*kg; a unit stands only"),
        ("2x", 2, "2*x"),
        ("a b", 3, "an operator is missing before 'b'"),
        ("a(b + c)", 1, "a product is written with *: a*(...)"),
        (")", 1, "cannot start with )"),
        ("sin x", 5, "sin(...)"),
        ("sin()", 5, "something is missing between '(' and ')'"),
        ("sin(1, 2)", 1, "sin(x) takes 1 argument, not 2"),
        ("2 + min(a)", 5, "min(a, b, ...) takes two or more arguments, not 1"),
        ("where(a, b)", 1, "takes 3 arguments, not 2"),
        ("a + sine(x)", 5, "did you mean sin?"),
        ("arctan(x)", 1, "did you mean atan(x)?"),
        ("Sqrt(x)", 1, "did you mean sqrt?"),
        ("postion(A, x)", 1, "did you mean position?"),
        ("a = b", 3, "difference of its sides"),
        ("a == b", 3, "comparisons are < <= > >="),
        ("a: b", 2, "a quotient is written with /"),
        ("(a + b", 1, "never closed; in a list or map {...} an expression that contains a comma is quoted"),
        ("atan2(y", 1, "never closed"),
        ("a)", 2, "this ) closes nothing"),
        ("a, b", 2, "a comma stands only between the arguments of a function"),
        ("1,5", 2, "a decimal is written 1.5"),
        ("(a, b)", 3, "a comma stands only"),
        ("rod.pin", 4, "names are joined by a dot only in"),
        ("a < b < c", 7, "comparisons do not chain"),
        ("a //b", 4, "a quotient is written with one /"),
        ("a * * b", 5, "a power is written ** or ^"),
        ("a and b", 3, "one of its sides is none"), ("a < b and", 10, "between 'and' and the end"),
        ("not a < b", 5, "'not' is no operator"), ("a < b or b", 7, "'or' joins conditions"),
        ("a +", 4, "something is missing between '+' and the end"),
        (".inf", 1, ".inf is no value: numbers are finite here; give a number, or leave the entry out"),
        ("-.Inf", 2, ".Inf is no value"), ("2*.nan", 3, ".nan is no value"), ("+.NaN", 2, ".NaN is no value"),
        ("1_000", 2, "digits are written without _"),
        ("1.2.3", 4, "1.2.3 has two decimal points"),
        ("'x'", 1, "cannot start with 'x'"),
        ("a + 'x'", 5, "quoted names stand only in the arguments"),
        ("a + 'x", 5, "the quote is never closed"),
        ("reaction(C)", 1, "reaction(joint, component) takes 2 arguments, not 1"),
        ("reaction(C, 2)", 13, "a name must stand here, not '2'"),
        ("position(rod-2, x)", 13, "'-' has no place in a name"),
        ("position(rod., x)", 14, "a name must stand here"),
        ("position('', x)", 10, "the quoted name is empty"),
        ("position('rod.pin', x)", 10, "quote the parts: 'my rod'.pin"),
        ("position(rod", 13, "the parenthesis of position( is never closed"),
        ("real(x)", 1, "real(...) takes one number"),
        ("1 + 1/0", 6, "division by zero"),
        ("9**9**9**9", 5, "is not a finite real number"),
        ("exp(exp(exp(10)))", 5, "is not a finite real number"),
        ("a + asin(2)", 5, "asin(2) is not a finite real number"),
        ("sqrt(-1)", 1, "is not a finite real number"),
        ("log(0)", 1, "is not a finite real number"),
        ("(-8)^(1/3)", 5, "is not a finite real number"),
        ("1e999", 1, "the exponent of a number is at most 400"),
        ("1e309", 1, "too large"),
        ("1e-399", 1, "too small"),
        ("a²", 2, "(U+00B2) has no place in an expression; write ^2"),
        ("2*phi'''", 8, "no name has more than two primes"),
        ("٣", 1, "expressions are written in ASCII"),
        ("a\x00", 2, "the character U+0000"),
        ("a + \ud800", 5, "the character U+D800"),
        ("a\u202eb", 2, "the character U+202E"),
        ("a\u00a0+ b", 2, "the character U+00A0"),
        ("[1, 2]", 1, "not a list"),
        ("\\alpha", 1, "without a backslash"),
    ],
)
def test_refusals_name_the_column(text, column, part):
    error = refusal(text)
    assert (error.where.column, part in error.message) == (column, True), str(error)
    shown, caret = error.excerpt.split("\n")
    assert caret.index("^") == 1 + column
    assert shown.isprintable()


def test_excerpt_of_a_long_expression_shows_the_surroundings():
    error = refusal("+".join(["abc"] * 100) + " ? " + "+abc" * 100)
    shown, caret = error.excerpt.split("\n")
    assert len(shown) < 100
    assert shown[caret.index("^")] == "?"
    assert shown.strip().startswith("...")
    assert shown.endswith("...")


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("1" * (tokens.MOST_DIGITS + 1), "digits"),
        ("a" * (tokens.LONGEST_NAME + 1), "a name has at most"),
        ("+".join(["a"] * tokens.MOST_TOKENS), "at most 50000 numbers, names and operators"),
        ("a" + " " * tokens.LONGEST_TEXT, "characters"),
        ("(" * 1000 + "a" + ")" * 1000, f"nested more than {DEEPEST} deep"),
        ("-" * 40_000 + "a", "nested more than"),
        ("sin(" * 1000, "nested more than"),
        ("2^" * 1000 + "a", "nested more than"),
        ("1e" + "9" * 300, "the exponent of a number"),
    ],
)
def test_limits_have_their_own_messages(text, part):
    assert part in refusal(text).message


def test_long_flat_and_deep_expressions_within_the_limits():
    assert parse("+".join(["a"] * 20_000)) is parse("a*2 + " + "+".join(["a"] * 19_998))
    assert parse("(" * (DEEPEST - 1) + "a" + ")" * (DEEPEST - 1)) is a
    assert parse("sin(" * 300 + "a" + ")" * 300).op == "sin"


def test_every_function_and_quantity_is_readable():
    for name, arguments in FUNCTIONS.items():
        count = 3 if arguments[-1] == "..." else len(arguments)
        text = f"{name}({', '.join(['a', 'b', 'c'][:count])})"
        assert parse(text).op == name
    for name, asked in QUANTITIES.items():
        if name.strip("'") == "":  # primes, which stand behind their argument
            assert parse(f"A{name}").data == (name, ("A",))
            continue
        assert parse(f"{name}({', '.join(['A'] * len(asked.arguments))})").data == (name, ("A",) * len(asked.arguments))


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("6 kg", 6, "kg"), ("6kg", 6, "kg"), ("-9.81 m/s^2", -9.81, "m/s^2"), ("0.033 N*m", 0.033, "N*m"),
        ("1e-3 kg*m^2", 1e-3, "kg*m^2"), ("500 g", 0.5, "kg"), ("45 deg", math.pi / 4, "rad"), ("2 N m", 2, "N*m"),
        ("30 rpm", math.pi, "rad/s"), ("2 rad/s", 2, "rad/s"), ("20 1/s", 20, "1/s"), ("+3 kN", 3000, "N"),
        ("90 km/h", 25, "m/s"), ("10 in", 0.254, "m"), ("3 N/(m*s)", 3, "kg/s^3"), ("2 min", 120, "s"),
        ("4 mm^2", 4e-6, "m^2"), ("2 m**2", 2, "m^2"), ("2 m s^-1", 2, "m/s"), ("2 m^(1/2)", 2, "m^(1/2)"),
    ],
)
def test_numbers_with_units(text, value, unit):
    node, dimension = parse_scalar(text)
    assert node.shadow == pytest.approx(value, rel=1e-15)
    assert str(dimension) == unit


def test_degrees_are_exact():
    assert parse_scalar("45 deg")[0] is PI / 4
    assert parse_scalar("-30 deg")[0] is -PI / 6


@pytest.mark.parametrize("text", ["6", "-9.81", "2*m", "m", "pi/4", "kg", "1/s", "2*(m)"])
def test_without_a_unit_it_is_an_expression(text):
    assert parse_scalar(text) == (parse(text), None)


@pytest.mark.parametrize(
    ("text", "column", "part"),
    [
        ("2 x", 3, "'x' is not a unit; a product is written with *: 2*x"),
        ("2 sin(x)", 3, "2*sin"),
        ("2 Kg", 3, "did you mean kg?"),
        ("2 meters", 3, "did you mean m?"),
        ("6 kg + 1 kg", 6, "one number with a unit, or an expression without units"),
        ("2 kg*x", 6, "'x' is not a unit"),
        ("1 + 6 kg", 7, "a unit stands only after a single number"),
        ("(6) kg", 5, "an operator is missing"),
        ("2 m^", 5, "the exponent of a unit is a number"),
        ("2 m^x", 5, "the exponent of a unit is a number"),
        ("2 m^99", 4, "at most 20"),
        ("2 m^(1/0)", 8, "division by zero"),
        ("2 N/m s", 7, "parentheses: N/(m*s)"),
        ("2 N/((m))", 6, "'(' has no place in a unit"),
        ("2 N/(m", 5, "never closed"),
        ("2 N/", 5, "the unit is not complete"),
        ("1e308 km", 1, "too large"),
    ],
)
def test_refused_units(text, column, part):
    with pytest.raises(ExpressionError) as caught:
        parse_scalar(text)
    assert (caught.value.where.column, part in caught.value.message) == (column, True), str(caught.value)
