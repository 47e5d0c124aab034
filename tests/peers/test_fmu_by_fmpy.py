"""FMUs in fmpy: its validation, CVODE and co-simulation against runs of our own, derivatives, states, instances."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

fmpy = pytest.importorskip("fmpy", reason="the peer fmpy (extra: peers) is not installed")

from fmpy.validation import validate_fmu  # noqa: E402 - which needs fmpy, too

EXAMPLES = Path(__file__).parents[2] / "examples"
CART = """
multibody_sym: 1
name: cart
gravity: [0, -9.81, 0]
parameters: {M: {value: 2 kg, positive: true}, l: 500 mm, k: 3, T: 100 ms}
bodies: {cart: {mass: M}, pole: {shape: {rod: l, mass: 200 g}}}
joints:
  track: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: pole, axis: z, q: theta, initial: {q: 95 deg}}
states: {f: {rate: (push - f)/T, initial: 1 N}}
inputs: {push: 0 N, hum: {table: [[0, 0], [0.3, 3], [0.5, -4], [2, 1]]}}
forces: {motor: {type: force, on: cart, value: [f + hum, 0, 0]}}
outputs: {held: fy(track), speed: u_x}
stop: {far: x > 0.5}
"""
STATES = ("x", "theta", "f", "u_x", "u_theta")
T_END = 1.0
NEAR = 1e-9
"""How near runs by CVODE (rtol 1e-12) and by co-simulation (1e-11) come to ours."""


@lru_cache
def cart() -> mbs.System:
    return mbs.loads(CART)


@lru_cache
def fmu(fmi: int) -> str:
    """Return the path of the cart's FMU."""
    path = f"{mkdtemp()}/cart.fmu"
    mbs.export(cart(), "fmu", path, fmi=fmi)
    return path


@lru_cache
def own_run() -> mbs.Trajectory:
    return mbs.simulate(cart(), t_end=T_END, samples=21, rtol=1e-12, inputs={"push": "4"}, parameters={"k": 2})


def run_of(path: str, kind: str, names: tuple[str, ...], **options: Any) -> np.ndarray:
    tolerance = {"ModelExchange": 1e-12, "CoSimulation": 1e-11}[kind]
    usual = {"stop_time": T_END, "output_interval": T_END / 20, "relative_tolerance": tolerance, "record_events": False}
    return fmpy.simulate_fmu(path, fmi_type=kind, output=names, **{**usual, **options})


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_runs_are_ours_and_stop_where_ours_do(fmi: int, kind: str) -> None:
    assert validate_fmu(fmu(fmi)) == []
    found = run_of(fmu(fmi), kind, (*STATES, "held", "speed"), start_values={"push": 4.0, "k": 2.0})
    own = own_run()
    before = found["time"] < own.t[-1] - 0.1
    assert 5 < before.sum() < 20
    for name in (*STATES, "held"):
        assert found[name][before] == pytest.approx(own[name][: before.sum()], rel=NEAR, abs=NEAR)
    assert own.final["coordinates"]["x"] == pytest.approx(0.5)
    if (fmi, kind) != (3, "CoSimulation"):  # of which fmpy records the end of the step
        every = run_of(fmu(fmi), kind, ("x",), start_values={"push": 4.0, "k": 2.0}, record_events=True)
        assert every["time"][-1] == pytest.approx(own.t[-1], abs=1e-6)


def instance(fmi: int, told: list[str]) -> Any:
    """Return an instance of the cart's FMU, which tells what is wrong into a list."""
    description = fmpy.read_model_description(fmu(fmi))

    def note(*of: Any) -> None:
        told.append(of[-1].decode())

    found = fmpy.instantiate_fmu(fmpy.extract(fmu(fmi)), description, "ModelExchange", logger=note)
    found.places = {variable.name: variable.valueReference for variable in description.modelVariables}
    return found


def started(fmi: int, told: list[str] | None = None, **values: float) -> Any:
    found = instance(fmi, [] if told is None else told)
    if fmi == 2:
        found.setupExperiment(startTime=0.0)
    found.enterInitializationMode()
    set_values = found.setReal if fmi == 2 else found.setFloat64
    set_values([found.places[name] for name in values], list(values.values()))
    found.exitInitializationMode()
    return found


def values(found: Any, *names: str) -> list[float]:
    get = found.getReal if hasattr(found, "getReal") else found.getFloat64
    return list(get([found.places[name] for name in names]))


@pytest.mark.parametrize("fmi", [2, 3])
def test_derivatives_are_those_of_functions(fmi: int) -> None:
    at = {"x": 0.1, "theta": 0.4, "f": 2.0, "u_x": -0.3, "u_theta": 1.5, "push": 0.7}
    found, f = started(fmi, **at), mbs.function(cart(), "state_derivative", backend="python")
    q, u = list(at.values())[:3], list(at.values())[3:5]
    rates = f(0.0, q, u, inputs={"push": 0.7})
    assert values(found, *(f"der({name})" for name in STATES)) == pytest.approx([*rates.qdot, *rates.udot], abs=1e-12)
    by_theta, by_push = f.derivative("q")(0.0, q, u).udot[:, 1], f.derivative("inputs")(0.0, q, u).qdot[:, 0]
    unknowns = [found.places[f"der({name})"] for name in ("f", "u_x", "u_theta")]

    def along(known: str) -> list[float]:
        return list(found.getDirectionalDerivative(unknowns, [found.places[known]], [1.0]))

    assert along("theta") == pytest.approx([0.0, *by_theta], abs=1e-12)
    assert along("push") == pytest.approx([by_push[2], 0.0, 0.0], abs=1e-12)
    found.freeInstance()


@pytest.mark.parametrize("fmi", [2, 3])
def test_instances_are_their_own_and_states_come_back(fmi: int) -> None:
    one, other = started(fmi, x=0.1, k=5.0), started(fmi, x=0.2)
    state = (one.getFMUstate if fmi == 2 else one.getFMUState)()
    written = (one.serializeFMUstate if fmi == 2 else one.serializeFMUState)(state)
    one.setContinuousStates((np.ctypeslib.ctypes.c_double * 5)(1, 2, 3, 4, 5), 5)
    assert values(one, "x", "u_theta") == [1.0, 5.0]
    assert values(other, "x", "k") == [0.2, 3.0]
    again = (other.deSerializeFMUstate if fmi == 2 else other.deserializeFMUState)(written)
    (other.setFMUstate if fmi == 2 else other.setFMUState)(again)
    assert values(other, "x", "k") == [0.1, 5.0]
    with pytest.raises(Exception, match="failed with status 3"):
        (one.setReal if fmi == 2 else one.setFloat64)([one.places["M"]], [-1.0])
    one.freeInstance()
    other.freeInstance()


@pytest.mark.parametrize("fmi", [2, 3])
def test_what_is_wrong_is_told_in_words(fmi: int) -> None:
    """Names or value references, the counts that were given, and what can be done."""
    told = list[str]()
    found = started(fmi, told, x=0.1)
    getting, setting = (found.getReal, found.setReal) if fmi == 2 else (found.getFloat64, found.setFloat64)
    hum, push = found.places["hum"], found.places["push"]
    calls = {
        "there is no variable with the value reference 999": lambda: setting([999], [1.0]),
        "there is no variable with the value reference 998": lambda: getting([998]),
        "x is set before the end of the initialization, or with all states": lambda: setting([1], [0.0]),
        "the variable with the value reference 0 follows from others and cannot be set": lambda: setting([0], [1.0]),
        f"the input with the value reference {hum} is computed in the FMU": lambda: setting([hum], [1.0]),
        f"the value for the reference {push} is not finite": lambda: setting([push], [np.inf]),
        "there are 5 states, not 3": lambda: found.setContinuousStates((np.ctypeslib.ctypes.c_double * 3)(), 3),
    }
    for message, call in calls.items():
        told.clear()
        with pytest.raises(Exception, match="failed with status 3"):
            call()
        assert told == [message]
    found.freeInstance()


def test_a_closed_loop_stays_closed() -> None:
    """The rocker of a four-bar after a second, with a crank of another length, which is closed at the beginning."""
    system = mbs.load(EXAMPLES / "four_bar.yaml")
    path = f"{mkdtemp()}/four_bar.fmu"
    mbs.export(system, "fmu", path)
    assert validate_fmu(path) == []
    names = ("crank_angle", "coupler_angle", "rocker_angle")
    own = mbs.simulate(system, t_end=T_END, samples=21, rtol=1e-12)
    for kind, near in (("ModelExchange", 1e-6), ("CoSimulation", 1e-8)):
        found = run_of(path, kind, names, relative_tolerance=1e-11)  # CVODE takes more steps than fmpy lets it for less
        for name in names:
            assert found[name] == pytest.approx(own[name], abs=near)
    found = run_of(path, "CoSimulation", names, start_values={"a": 0.15})
    a, b, c, d = 0.15, 0.5, 0.4, 0.5
    crank, coupler, rocker = (found[name] for name in names)
    tip = a * np.exp(1j * crank) + b * np.exp(1j * (crank + coupler))
    assert abs(tip - d - c * np.exp(1j * rocker)) == pytest.approx(0.0, abs=1e-9)


STIFF = """
multibody_sym: 1
name: stiff
parameters: {m: 1 kg, c: 1e6 N*s/m, k: 1e6 N/m}
bodies: {a: {mass: m}}
joints: {path: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: 1 m}}}
forces: {spring: {type: spring_damper, between: [ground, a], stiffness: k, damping: c, length: 0}}
simulation: {method: radau_5, rtol: 1e-8}
"""


def test_a_stiff_model_has_its_implicit_method(tmp_path: Path) -> None:
    """x'' + c x' + k x = 0 has roots near -1 and -1e6 1/s: steps of an explicit method would be of 3 us."""
    (file,) = mbs.export(mbs.loads(STIFF), "fmu", tmp_path / "stiff.fmu")
    assert validate_fmu(str(file)) == []
    found = run_of(str(file), "CoSimulation", ("x",), relative_tolerance=1e-10, timeout=10)
    fast = 0.5 * (1e6 + np.sqrt(1e12 - 4e6))
    slow = 1e6 / fast
    assert found["x"][1:] == pytest.approx(fast / (fast - slow) * np.exp(-slow * found["time"][1:]), rel=1e-8)


@lru_cache
def thrown() -> mbs.System:
    """A block is thrown onto a rough floor, bounces, slides and comes to rest."""
    return mbs.loads("""
multibody_sym: 1
name: thrown
gravity: [0, -9.81, 0]
parameters: {v: 3, mu: 0.3}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, a: {mass: 2}}
joints: {j: {type: point, parent: ground, child: a, q: [x, y], initial: {q: [0, 0.5], u: [v, 0]}}}
contacts: {c: {between: [a, ground.floor], static: mu, restitution: 0.4}}
inputs: {push: 0 N}
forces: {hand: {type: force, on: a, value: [push, 0, 0]}}
outputs: {pressed: normal(c)}
""")


@pytest.mark.parametrize(("fmi", "kind", "near"), [(2, "CoSimulation", 1e-9), (3, "ModelExchange", 1e-6)])
def test_contacts_go_from_state_to_state(tmp_path: Path, fmi: int, kind: str, near: float) -> None:
    """Impacts, rest after infinitely many of them, sliding and sticking are those of a run by the same friction."""
    (file,) = mbs.export(thrown(), "fmu", tmp_path / "thrown.fmu", fmi=fmi)
    assert validate_fmu(str(file)) == []
    names, told = ("x", "y", "u_x", "u_y", "pressed"), list[str]()
    given = {"start_values": {"mu": 0.4, "push": 1.0}, "stop_time": 2.0, "output_interval": 0.1}

    def note(*told_of: Any) -> None:
        told.append(told_of[-1].decode())

    found = run_of(str(file), kind, names, **given, debug_logging=True, logger=note)
    own = mbs.simulate(thrown(), t_end=2.0, samples=21, rtol=1e-12, parameters={"mu": "0.4"}, inputs={"push": "1"})
    for name in names[:4]:
        assert found[name] == pytest.approx(own[name], abs=near)
    assert found["pressed"][-1] == pytest.approx(2 * 9.81, rel=1e-9)
    words = [text.split(": ")[1] for text in told if text.startswith("t = ")]
    assert words[:3] == ["c impact"] * 3
    assert words[-1] == "c stick"
    assert {"c impact", "c stick"} <= {*words} <= {"c impact", "c slide+", "c stick"}
