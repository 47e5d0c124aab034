"""What is handed over by mistake is answered in words that say what to do instead."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.model.argument_checks import door
from multibody_sym.model.fields import Element
from multibody_sym.scalars.node import as_node

TEXT = """\
multibody_sym: 1
name: s
bodies: {a: {mass: 1, com: [1, 0, 0]}}
forces:
joints: {A: {type: planar, parent: ground, child: a, motion: [null, null, 0], initial: {q: [1, 0]}}}
constraints: {rod: {type: distance, between: [ground, a], value: 1}}
"""
SYSTEM = mbs.loads(TEXT)
RUN = mbs.simulate(SYSTEM, t_end=0.1, samples=2)
DECIMAL = mbs.loads(TEXT.replace("name: s", "name: s\nparameters: {d: 1}"))


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: mbs.compile(SYSTEM), r"compile\(state_derivative\(system\)\)"),
        (lambda: mbs.compile(mbs.state_derivative(SYSTEM), backend="java"), "no backend 'java'; known: c, python"),
        (lambda: mbs.simulate(SYSTEM, backend="java"), "no backend 'java'; known: c, python"),
        (lambda: mbs.simulate(SYSTEM, t_end=0.1, samples=2)[0], r"asked by name, such as run\['theta'\]"),
        (lambda: mbs.parameters("a b", 5), "2 names, 1 values"),
        (lambda: mbs.parameters(["a", "b"], [1, 2]), "expected names separated by spaces, got a list"),
        (lambda: mbs.linearize(SYSTEM, parameters=[3]), r"parameters is to be a map .* such as {'m': 2}, a parameter"),
        (lambda: mbs.linearize(SYSTEM, initial=[1]), r"initial is to be a map .* such as {'phi': 0.1}, a coord"),
        (lambda: mbs.linearize(SYSTEM, inputs=3), r"inputs is to be a map .* such as {'force': '2\*sin\(t\)'}"),
        (lambda: mbs.Body(com=[0, -1]), r"expected a list of three .*, got a list of 2; .* the third is 0"),
        (lambda: mbs.Body(com=np.ones(4)), r"expected a list of three numbers or expressions, got a list of 4$"),
        (lambda: mbs.load(None), "expected the path of a model file, got None"),
        (lambda: mbs.dumps("pendulum.yaml"), "expected a System, got 'pendulum.yaml'"),
        (lambda: mbs.Body(mass=np.array([1.0, 2.0])), "expected a number or an expression"),
        (lambda: mbs.loads(TEXT.replace("mass: 1,", "mass: ,")), "bodies.a.mass: mass is empty: write what it is"),
        (lambda: mbs.loads(TEXT.replace("[1, 0, 0]", "")), "bodies.a.com: com is empty: write what it is"),
    ],
)
def test_mistakes_are_named(act: Callable[[], Any], message: str) -> None:
    with pytest.raises(mbs.MultibodyError, match=message):
        act()


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: mbs.Revolute("ground", "bob", "z"), r"takes 2 by their places .* got 3, 'z' the .* axis=\.\."),
        (lambda: mbs.Revolute("ground"), "Revolute is missing child, the body, point or frame that it carries"),
        (lambda: mbs.Revolute("ground", child="bob", axes="z"), "Revolute has no field 'axes'; did you mean axis"),
        (lambda: mbs.Revolute("ground", "bob", parent="a"), "given parent twice: by its place and by its name"),
        (lambda: mbs.Body(maas=2), "Body has no field 'maas'; did you mean mass"),
        (mbs.System, "System is missing name, what the system is called"),
        (lambda: mbs.Shape("rod", 1, 2, 3), "takes 3 by their places .* got 4, 3 the first too many$"),
    ],
)
def test_elements_tell_which_arguments_do_not_fit(act: Callable[[], Any], message: str) -> None:
    with pytest.raises(mbs.InputError, match=message) as caught:
        act()
    assert isinstance(caught.value, TypeError)
    assert caught.value.number == "A100"


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: mbs.solve(SYSTEM, stepps=True), "solve has no argument 'stepps'; did you mean steps"),
        (lambda: mbs.simulate(SYSTEM, 3), r"simulate takes 1 by their places \(system\), and got 2, 3 .* t_end=\.\."),
        (lambda: mbs.sweep(vary={}), "sweep is missing system$"),
        (lambda: mbs.sin(1, a=2), "sin is given a twice"),
        (lambda: RUN.plot(fil="x.svg"), r"Trajectory\.plot has no argument 'fil'; known: path"),
    ],
)
def test_functions_tell_which_arguments_do_not_fit(act: Callable[[], Any], message: str) -> None:
    with pytest.raises(mbs.InputError, match=message) as caught:
        act()
    assert isinstance(caught.value, TypeError)
    assert caught.value.number == "A100"


def test_every_function_has_words_for_arguments_that_do_not_fit() -> None:
    functions = [f for f in (getattr(mbs, name) for name in dir(mbs)) if type(f) is FunctionType]
    functions = [f for f in functions if f.__module__ == "multibody_sym" and not f.__name__.startswith("_")]
    assert len(functions) > 30
    for function in functions:
        assert pickle.loads(pickle.dumps(function)) is function
        with pytest.raises(mbs.InputError, match=f"^{function.__name__} has no argument 'no_such'"):
            function(no_such=1)


def test_a_type_error_from_within_is_left_alone() -> None:
    @door
    def broken(_x: float) -> None:
        raise TypeError("of the user's own")

    with pytest.raises(TypeError, match=r"^of the user's own$"):
        broken(1)


def test_every_element_has_words_for_arguments_that_do_not_fit() -> None:
    public = [getattr(mbs, name) for name in dir(mbs)]
    classes = [cls for cls in public if isinstance(cls, type) and issubclass(cls, Element)]
    assert len(classes) > 40
    for cls in classes:
        for act in (lambda cls=cls: cls(no_such_field=1), lambda cls=cls: cls(*range(40))):
            with pytest.raises(mbs.InputError, match=f"^{cls.__name__} (has no field|takes)"):
                act()


def test_arrays_and_single_values_are_welcome() -> None:
    (m,) = mbs.parameters("m", "2 kg", positive=True)
    assert mbs.Body(mass=np.array(1.0)) == mbs.Body(mass=1)
    assert mbs.Body(mass=m, com=np.array([1.0, 0.0, 2.0])).com == mbs.Body(com=[1, 0, 2]).com


def test_decimals_are_values_exactly() -> None:
    (half,) = mbs.parameters("m", Decimal("0.5"))
    assert mbs.Body(mass=Decimal("0.5")) == mbs.Body(mass=Fraction(1, 2))
    exact = [Overrides({"d": Decimal(text)}).of(DECIMAL).parameters["d"].value for text in ("0.5", "0.10")]
    assert exact == [as_node(Fraction(1, 2)), as_node(Fraction(1, 10))]
    assert mbs.sqrt(Decimal("0.25")) == 0.5
    assert half + Decimal("0.5") is half + Fraction(1, 2)


def test_baumgarte_may_be_given_as_itself() -> None:
    run = mbs.simulate(SYSTEM, t_end=0.1, samples=2, constraints=mbs.Baumgarte(alpha=3))
    assert run.baumgarte == {"alpha": 3.0, "beta": 3.0}


def test_check_without_a_start_tells_no_numbers() -> None:
    longer = "value: 1}, longer: {type: distance, between: [ground, a], value: 2}"
    report = mbs.check(mbs.loads(TEXT.replace("value: 1}", longer)))
    found = report.as_json()
    assert report.failure
    assert [found[name] for name in ("degrees_of_freedom", "rank", "shift", "agreement")] == [None, None, None, {}]
