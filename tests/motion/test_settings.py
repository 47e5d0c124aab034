"""Settings of a run: expressions of parameters, defaults, and what is wrong with them by path."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.changes import with_settings, with_values
from multibody_sym.motion.prepare.settings import Coefficients, run_settings
from multibody_sym.scalars.node import symbol


def settings(**given):
    return run_settings(mbs.Settings(**given), {symbol("T"): 2.0, symbol("n"): 11.0})


def test_defaults() -> None:
    chosen = settings()
    assert (chosen.method.name, chosen.step, chosen.rtol, chosen.samples) == ("dormand_prince", None, 1e-9, 1001)
    assert chosen.atol == pytest.approx(1e-10)
    assert chosen.t_end == 10.0
    assert chosen.project
    assert chosen.baumgarte is None


def test_expressions_of_parameters() -> None:
    chosen = settings(t_end="5*T", samples="10*n + 1", rtol="1e-3/T")
    assert (chosen.t_end, chosen.samples, chosen.rtol) == (10.0, 111, 5e-4)
    assert chosen.atol == pytest.approx(5e-5)


@pytest.mark.parametrize(
    ("constraints", "project", "baumgarte"),
    [
        ({"projection": "true"}, True, None),
        ({"projection": "false"}, False, None),
        ({"baumgarte": {}}, False, Coefficients(None, None)),
        ({"baumgarte": {"beta": "3/T"}}, False, Coefficients(1.5, 1.5)),
        ({"baumgarte": {"alpha": 1, "beta": 0}}, False, Coefficients(1.0, 0.0)),
    ],
)
def test_constraints(constraints, project: bool, baumgarte: Coefficients | None) -> None:
    chosen = settings(constraints=constraints)
    assert (chosen.project, chosen.baumgarte) == (project, baumgarte)


@pytest.mark.parametrize(
    ("given", "path", "message"),
    [
        ({"t_end": 0}, "t_end", "positive"),
        ({"t_end": "1/(T - 2)"}, "t_end", "no value"),
        ({"t_end": "exp(1000*T)"}, "t_end", "no value"),
        ({"step": -1}, "step", "positive"),
        ({"rtol": "log(T - 2)"}, "rtol", "no value"),
        ({"rtol": 2}, "rtol", "rtol = 2 lets a step err by more than a tenth .*; ask for 1e-15 to 0.1"),
        ({"samples": 1}, "samples", "whole number"),
        ({"samples": "T/3"}, "samples", "whole number"),
        ({"method": "dormand-prince"}, "method", "did you mean dormand_prince"),
        ({"method": "rk4"}, "method", "needs a step"),
        ({"step": 1, "rtol": 1}, "step", "not both"),
        ({"constraints": {"baumgarte": {"alpha": -1}}}, "constraints.baumgarte.alpha", "not negative"),
    ],
)
def test_wrong_settings_name_their_path(given, path: str, message: str) -> None:
    with pytest.raises(mbs.ModelError, match=message) as caught:
        settings(**given)
    assert ".".join(caught.value.where.path) == f"simulation.{path}"


def test_a_step_replaces_tolerances_and_the_other_way_round() -> None:
    system = mbs.System("m", simulation={"step": 1})
    assert with_settings(system, {"rtol": 1e-3, "t_end": None}).simulation == mbs.Settings(rtol=1e-3)
    system = mbs.System("m", simulation={"rtol": 1e-3, "atol": 1})
    assert with_settings(system, {"step": 1}).simulation == mbs.Settings(step=1)
    assert with_settings(system, {"t_end": None}) is system


def test_values_replace_numbers_and_keep_the_rest() -> None:
    mass, length = mbs.parameters("m l", ["1 kg", "2 m"], positive=True)
    system = mbs.System("s", bodies={"b": mbs.Body(mass=mass, com=[length, 0, 0])})
    changed = with_values(system, {"m": "500 g"})
    assert changed.parameters["m"].value.shadow == 0.5
    assert changed.parameters["m"].positive
    assert list(changed.parameters) == list(system.parameters)
    assert changed.parameters["l"] == system.parameters["l"]
    assert with_values(system, {}) is system


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("mm", 1, "did you mean m"),
        ("m", "1 s", "quantity in kg"),
        ("m", "1 +", "missing"),
        ("m", [1], "expected a number"),
    ],
)
def test_wrong_values(name: str, value: object, message: str) -> None:
    (m,) = mbs.parameters("m", ["1 kg"])
    with pytest.raises(mbs.InputError, match=message) as caught:
        with_values(mbs.System("s", bodies={"b": mbs.Body(mass=m)}), {name: value})
    assert caught.value.where.path == (name,)


@pytest.mark.parametrize("rtol", [1e-30, 1e-20, 9e-16])
def test_no_tolerance_is_finer_than_numbers(rtol: float) -> None:
    slider = mbs.Prismatic("ground", "b", axis="x")
    system = mbs.System("one", bodies={"b": mbs.Body(mass=1)}, joints={"j": slider})
    with pytest.raises(mbs.InputError, match="16 digits; ask for 1e-15 or more"):
        mbs.simulate(system, t_end=1, rtol=rtol)
