"""The printer: readable text, which the parser reads back to the identical Node."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import PI, Node, as_node, number, quantity, real, slot, symbol, symbol_with
from multibody_sym.text.parser import FUNCTIONS, parse
from multibody_sym.text.printer import text

LEAVES = st.one_of(
    st.sampled_from(["a", "b", "m1", "r", "x", "E", "lambda", "sin", "t", "phi_2"]).map(symbol),
    st.integers(-20, 20).map(number),
    st.fractions(-50, 50, max_denominator=60).map(number),
    st.floats(1e-12, 1e12).map(as_node),
    st.floats(-100, 100).map(real),
    st.sampled_from([PI, quantity("position", ("my rod.it's", "x")), quantity("total_energy", ())]),
)
ARITIES = {name: 2 if args[-1] == "..." else len(args) for name, args in FUNCTIONS.items()}
FREQUENT = [("neg", 1), ("add", 2), ("mul", 2), ("div", 2), ("pow", 2)]
OPERATIONS = st.sampled_from([*FREQUENT * 4, ("less", 2), ("less_equal", 2), *ARITIES.items()])


@st.composite
def operation(draw: st.DrawFn, below: st.SearchStrategy[Node]) -> Node:
    op, arity = draw(OPERATIONS)
    operands = [draw(below) for _ in range(arity)]
    try:
        return BUILD[op](*operands)
    except ExpressionError:  # a constant without a finite real value
        return operands[0]


NODES = st.recursive(LEAVES, operation, max_leaves=25)


@settings(max_examples=600, deadline=None)
@given(NODES)
def test_the_parser_reads_back_the_identical_node(node):
    assert parse(text(node)) is node


@pytest.mark.long
@settings(max_examples=20_000, deadline=None)
@given(NODES)
def test_the_parser_reads_back_the_identical_node_long(node):
    assert parse(text(node)) is node


@pytest.mark.parametrize(
    "shown",
    [
        "m1*r^2/12", "a - b", "a - (b - c)", "-(a + b)", "-a*b", "80/3", "0.1", "9.81*m", "0.033*x", "5*x/3", "x/2",
        "2*(a/b)", "2*a/b", "(-a)^b", "(a^b)^c", "a^b^c", "2^(-x)", "x^(1/3)", "x^1.5", "1e-300*x", "1e10", "2.5e11*E",
        "pi/4", "2*pi*x", "a/(b*c)", "a/b/c", "a*b*c", "(a + b)*(a - b)", "where(x < 0, -1, 1)", "min(a, b, c)",
        "x - 3", "-3 - x", "(-3)/x", "-3/x", "(x < 1) + 2", "sqrt(a^2 + b^2)", "0.00012", "1e-5", "1500000", "-x",
        "a < b and b < c",
        "a < b or b < c and c < x", "(a < b or b < c) and c < x", "where(a < b and x <= 1, a, b)",
        "min(x, a < b)", "(a < b and b < c) + 2", "real(0.1)*x", "fx(C)", "friction_1(c.corner1)", "theta' + theta''",
        "position('my rod'.pin, x)",
        "x <= 2",
    ],
)
def test_what_people_would_write_is_kept(shown):
    assert text(parse(shown)) == shown


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("1/12*m1*r**2", "m1*r^2/12"), ("a + -b", "a - b"), ("((a))", "a"), ("0.5*m", "m/2"), ("(a*b)/(3)", "a*b/3"),
        ("a*(b*c)", "b*c*a"), ("(x)^(2)", "x^2"), ("2*3*x", "6*x"), ("x*80/3", "80*x/3"), ("1e3", "1000"),
        ("0.00390625*x", "x/256"), ("3*x/1024", "3*x/1024"), ("0.0375*x", "0.0375*x"),
        ("0.3125*x", "5*x/16"), ("122.625*x", "122.625*x"), ("9.8*x", "9.8*x"),
        ("acos(0)", "pi/2"), ("atan(-1)", "-pi/4"),
    ],
)
def test_other_ways_to_write_it_print_alike(written, shown):
    assert text(parse(written)) == shown


def test_numbers_print_exactly():
    for value in (0.1, 1 / 3, 1e-7, 123456.789, 5e-324, 1.7976931348623157e308, 2**60, Fraction(7, 3)):
        node = as_node(value)
        assert parse(text(node)) is node
        assert Fraction(text(node)) == node.data


def test_slots_and_declared_symbols_print_for_people():
    assert text(slot("q", 0) + 1) == "q[0] + 1"
    assert text(2 * symbol_with("m", "its declaration")) == "2*m"


def test_shared_expressions_that_would_explode_are_refused():
    node = symbol("x")
    for k in range(60):
        node = node * (node + k)
    with pytest.raises(ExpressionError, match="give its parts names"):
        text(node)


def test_a_long_sum_prints_without_recursion():
    names = [f"x{k}" for k in range(5000)]
    node = parse(" + ".join(names))
    assert parse(text(node)) is node
