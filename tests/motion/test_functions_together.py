"""Several Functions in one library; residuals of loops, sparse values, text with units, inputs that are held."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any, get_args, get_overloads, get_type_hints

import numpy as np
import pytest
from scipy.sparse import coo_array

import multibody_sym as mbs
from multibody_sym.dynamics.programs.state_functions import OPTIONS, Name
from multibody_sym.motion import function as function_module
from multibody_sym.motion.function_values import RESULTS
from multibody_sym.scalars.arrays import Floats

EXAMPLES = Path(__file__).parents[2] / "examples"
CART = """
multibody_sym: 1
name: cart
gravity: [0, -9.81, 0]
parameters: {m: 0.7 kg, l: 0.5 m, k: -2 N/m, c: 1 N*s/m}
bodies:
  cart: {mass: 2 kg}
  pole: {mass: m, com: [0, -l, 0], inertia: {Izz: 0.02}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: pole, q: a}
forces: {drive: {type: force, on: cart, value: [push, 0, 0]}}
inputs: {push: k*x - c*u_x}
"""
STATE = 0.0, np.array([0.1, 0.7]), np.array([0.3, -0.4])


@pytest.fixture(scope="module")
def cart() -> mbs.System:
    return mbs.loads(CART)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_functions_of_one_library_are_those_of_many(cart: mbs.System, backend: Any) -> None:
    asked: dict[str, Any] = {
        "M": "mass_matrix",
        "motion": "state_derivative",
        "tip": {"what": "frame", "frame": "pole", "axes": "local"},
        "motion 2": {"what": "state_derivative", "by": ["q", "u"]},
        "place": ["x - 0.5*sin(a)", "u_x"],
    }
    found = mbs.functions(cart, asked, backend=backend)
    assert list(found) == list(asked)
    alone = {
        "M": mbs.function(cart, "mass_matrix", backend=backend),
        "motion": mbs.function(cart, "state_derivative", backend=backend),
        "tip": mbs.function(cart, "frame", frame="pole", axes="local", backend=backend),
        "motion 2": mbs.function(cart, "state_derivative", backend=backend).derivative("q").derivative("u"),
        "place": mbs.function(cart, ["x - 0.5*sin(a)", "u_x"], backend=backend),
    }
    for name, each in found.items():
        results, others = each(*STATE), alone[name](*STATE)
        pairs = [(results, others)] if isinstance(results, np.ndarray) else list(zip(results, others, strict=True))
        for here, there in pairs:
            np.testing.assert_array_equal(here, there)
    pushed = found["motion"](*STATE, inputs={"push": 3.0}).udot
    np.testing.assert_array_equal(pushed, alone["motion"](*STATE, inputs={"push": 3.0}).udot)
    assert len({each._compiled.path for each in found.values()}) == 1
    assert len({each._compiled.path for each in alone.values()}) == len(alone)
    again = pickle.loads(pickle.dumps(found["motion 2"]))
    np.testing.assert_array_equal(again(*STATE).udot, found["motion 2"](*STATE).udot)


def test_overloads_promise_what_functions_return(cart: mbs.System) -> None:
    """Of each name the type that its overload returns, with the fields that the Program has, for derivatives too."""
    promised: dict[str, Any] = {}
    for each in get_overloads(function_module.function):
        hints = get_type_hints(each)
        names = [x for part in (hints["what"], *get_args(hints["what"])) for x in get_args(part) if isinstance(x, str)]
        promised = dict.fromkeys(names, get_args(hints["return"])[0]) | promised  # the first that fits
    for name in get_args(Name):
        if name in ("impact", "outputs"):  # which this system has not, or which have names of their own
            continue
        function = mbs.function(cart, name, **({"frame": "cart"} if "frame" in OPTIONS.get(name, ()) else {}))
        result = RESULTS.get(name)
        assert promised[name] == (result or Floats), name
        assert function.names == (result._fields if result else function.names[:1]), name  # type: ignore[attr-defined]
        assert function._tuple is result or not result
        assert function.derivative("q")._tuple is function._tuple or not result
    assert promised["impact"] is RESULTS["impact"]


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({}, "asked is a map from names to what function takes"),
        ({"a": "mass_matrx"}, "a: there is no function 'mass_matrx'; did you mean mass_matrix"),
        ({"a": "impact"}, "a: nothing strikes: the system has no impact"),
        ({"a": {"wat": "bias"}}, "a: there is no option 'wat'; did you mean what"),
        ({"a": {"what": "frame"}}, "a: which frame"),
        ({"a": {"what": "bias", "by": "s"}}, "a: bias is no function of 's'"),
        ({"a": {"frame": "pole"}}, "a: what is a name or a list of expressions, not None"),
    ],
)
def test_what_is_wrong_among_several_is_named(cart: mbs.System, asked: Any, message: str) -> None:
    with pytest.raises(mbs.InputError, match=message):
        mbs.functions(cart, asked)


def test_the_residual_is_how_far_a_loop_is_open() -> None:
    """The end of the coupler less that of the rocker, by hand, at coordinates that close nothing."""
    system = mbs.load(EXAMPLES / "four_bar.yaml")
    motion = mbs.function(system, "state_derivative", backend="python")
    q = np.array([[0.3, -0.4, 1.2], [1.0, 0.2, 2.0]])
    open_by = []
    for crank, coupler, rocker in q:
        at = crank + coupler
        coupled = 0.2 * np.array([np.cos(crank), np.sin(crank)]) + 0.5 * np.array([np.cos(at), np.sin(at)])
        open_by.append(np.linalg.norm(coupled - [0.5 + 0.4 * np.cos(rocker), 0.4 * np.sin(rocker)]))
    found = motion.residual(0.0, q, np.zeros(3))
    assert np.linalg.norm(found, axis=1) == pytest.approx(open_by, rel=1e-13)
    begin = mbs.solve(system).as_json()["coordinates"]
    closed = [begin[c.name] for c in mbs.mechanism(system).coordinates]
    assert np.abs(motion.residual(0.0, closed, np.zeros(3))).max() < 1e-14
    mass = mbs.function(system, "mass_matrix", backend="python")
    np.testing.assert_array_equal(mass.residual(0.0, q, np.zeros(3)), found)
    assert motion.residual(0.0, q[0], np.zeros(3), parameters={"a": 0.0})[:2] != pytest.approx(found[0][:2])


def test_sparse_values_are_those_at_the_places_of_sparsity(cart: mbs.System) -> None:
    slopes = mbs.function(cart, "state_derivative", backend="python").derivative("u")
    whole, values = slopes(*STATE), slopes(*STATE, sparse=True)
    for name, places in slopes.sparsity.items():
        matrix = coo_array((getattr(values, name), places), shape=slopes.shapes[name])
        np.testing.assert_array_equal(matrix.toarray(), getattr(whole, name))
    assert len(values.qdot) == 2  # a diagonal
    many = mbs.function(cart, "mass_matrix", backend="python")(0.0, np.zeros((3, 2)), np.zeros(2), sparse=True)
    assert many.shape == (3, 4)
    energies = mbs.function(cart, "energies", backend="python")
    assert energies.sparsity == {"kinetic": (), "potential": ()}
    assert energies(*STATE, sparse=True) == energies(*STATE)
    with pytest.raises(mbs.InputError, match="out= takes whole results"):
        slopes(*STATE, sparse=True, out=whole)


def test_numbers_may_have_units_in_calls(cart: mbs.System) -> None:
    motion = mbs.function(cart, "state_derivative", backend="python")
    expected = motion(*STATE, parameters={"m": 0.3, "l": 0.2}, inputs={"push": 2000.0}).udot
    found = motion(*STATE, parameters={"m": "300 g", "l": "20 cm"}, inputs={"push": "2 kN"}).udot
    np.testing.assert_array_equal(found, expected)
    rhs = mbs.compile(mbs.state_derivative(cart), backend="python")
    x = np.concatenate(STATE[1:])
    np.testing.assert_array_equal(rhs(0.0, x, {"m": "300 g"}), rhs(0.0, x, {"m": 0.3}))
    for wrong, message in (
        ({"parameters": {"m": "2 N"}}, r"parameters\.m: '2 N' does not fit here: expected a quantity in kg"),
        ({"parameters": {"m": "2*l"}}, r"parameters\.m: '2\*l' is no number: an expression has no value here"),
        ({"inputs": {"push": "2 kg"}}, r"inputs\.push: '2 kg' does not fit here: expected a quantity in N"),
    ):
        with pytest.raises(mbs.InputError, match=message):
            motion(*STATE, **wrong)


def test_free_inputs_keep_their_values_in_a_derivative(cart: mbs.System) -> None:
    """By differences of calls with the value that the declared input has at the state."""
    motion = mbs.function(cart, "state_derivative", backend="python")
    t, q, u = STATE
    held = {"push": -2 * q[0] - u[0]}
    for by, closed in (("q", (-2, 0)), ("u", (-1, 0))):
        free = motion.derivative(by, inputs="free")
        slopes = []
        for way in np.eye(2):
            at = [(q + h * way, u) if by == "q" else (q, u + h * way) for h in (1e-6, -1e-6)]
            ahead, behind = (motion(t, *each, inputs=held).udot for each in at)
            slopes.append((ahead - behind) / 2e-6)
        np.testing.assert_allclose(free(*STATE).udot, np.transpose(slopes), atol=1e-8)
        of_input = motion.derivative("inputs")(*STATE).udot
        whole = free(*STATE).udot + of_input @ np.array([closed])
        np.testing.assert_allclose(motion.derivative(by)(*STATE).udot, whole, rtol=1e-13, atol=1e-13)
        again = pickle.loads(pickle.dumps(free))
        np.testing.assert_array_equal(again(*STATE).udot, free(*STATE).udot)


def test_what_are_no_results_is_told(cart: mbs.System) -> None:
    motion = mbs.function(cart, "state_derivative", backend="python")
    for wrong in (3, None, (1, 2, 3)):
        with pytest.raises(mbs.InputError, match="these are no results of state_derivative"):
            motion.failed(wrong)
    with pytest.raises(mbs.InputError, match="leave out sparse"):
        motion.jvp(*STATE, rates={"q": [1, 0]}, sparse=True)


def test_the_residual_of_a_function_without_forces_leaves_out_contacts() -> None:
    text = """
multibody_sym: 1
name: block
bodies: {block: {mass: 1, points: {p: [0, 0, 0]}}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {J: {type: point, parent: ground, child: block}}
constraints: {track: {type: expression, zero: J_x - 2}}
contacts: {c: {between: [block.p, ground.floor], static: 0.2}}
"""
    system, at = mbs.loads(text), (0.0, [2.5, 0.3], [0.0, 0.0])
    assert mbs.function(system, "mass_matrix", backend="python").residual(*at).tolist() == [0.5]
    closed = mbs.function(system, "state_derivative", mode={"c": "stick"}, backend="python").residual(*at)
    assert closed.tolist() == [0.5, 0.3, 0.0]


def test_the_signature_has_shapes_and_units(cart: mbs.System) -> None:
    assert repr(mbs.function(cart, "mass_matrix", backend="python")) == (
        "<Function mass_matrix of cart: (t [s], q (2,) [m, rad], u (2,) [m/s, rad/s]) -> "
        "mass_matrix (2, 2) [kg, kg*m, kg*m^2]>"
    )
