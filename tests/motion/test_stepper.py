"""Systems stepped from outside against whole runs with the same inputs, alone, in a batch, over contacts and stops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rolling_and_loops import FOUR_BAR as LINKAGE
from scipy.integrate import solve_ivp

import multibody_sym as mbs

CART = """multibody_sym: 1
name: cart
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, M: 2 kg, l: 1 m, k: 1 N/m, f: 2 N}
bodies:
  cart: {mass: M}
  bob: {mass: m, com: [0, -l, 0]}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: 0.25}}
  pin: {type: revolute, parent: cart, child: bob, axis: z, q: phi, initial: {q: 0.3}}
inputs: {F: f*cos(3*t) - k*x, wind: 0 N}
forces:
  push: {type: force, on: cart, value: [F + wind, 0, 0]}
outputs: {tip: x + l*sin(phi), work: k*x^2/2}
stop: {far: x > 2}
"""
BLOCK = """multibody_sym: 1
name: block
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  block: {mass: 1 kg}
joints:
  free: {type: point, parent: ground, child: block, q: [x, y]}
inputs: {F: "where(t < 0.5, 3, where(t < 0.8, 8, -2))"}
forces:
  push: {type: force, on: block, value: [F, 0, 0]}
contacts:
  c: {between: [block, ground.floor], static: 0.5, kinetic: 0.4}
outputs: {friction: friction(c)}
simulation: {t_end: 1.5 s, samples: 31}
"""
FOUR_BAR = f"{LINKAGE}forces: {{motor: {{type: torque, joint: a, value: M}}}}\ninputs: {{M: 0.4}}\n"


@pytest.fixture(scope="module")
def cart() -> mbs.Prepared:
    return mbs.prepare(mbs.loads(CART), method="rk4", step="2 ms", t_end=1, samples=11)


@pytest.fixture(scope="module")
def block() -> mbs.Prepared:
    return mbs.prepare(mbs.loads(BLOCK))


def push(t: float) -> float:
    """Return the input that the block declares, between times at which it jumps."""
    return 3.0 if t < 0.499 else 8.0 if t < 0.799 else -2.0


def test_a_held_input_is_that_of_a_run(cart: mbs.Prepared) -> None:
    sim = cart.stepper("20 ms", inputs="F")
    for _ in range(50):
        sim.step([1.5])
    whole = cart.run(inputs={"F": 1.5}, t_end=1)
    assert sim.t == whole.t_final == 1.0
    assert np.allclose([*sim.q, *sim.u], [whole[name][-1] for name in ("x", "phi", "u_x", "u_phi")], rtol=1e-13)
    assert sim["tip"] == pytest.approx(whole["tip"][-1], rel=1e-13)
    assert sim["F"] == 1.5
    assert sim.x.tolist() == [*sim.q, *sim.u]
    assert set(sim.outputs) == {"tip", "work"}


def test_a_controller_is_held_from_step_to_step(cart: mbs.Prepared) -> None:
    """Second route: scipy's integrator over each step, on the Function with the same inputs."""
    adaptive = mbs.prepare(cart.system, rtol=1e-11, atol=1e-11, step=None, method="dormand_prince")
    sim, f = adaptive.stepper(0.05), mbs.function(cart.system, "state_derivative")
    x = np.concatenate([sim.q, sim.u])
    for k in range(20):
        held = np.array([-3.0 * x[0] - x[2], 0.4])
        assert np.allclose(held, [-3.0 * sim["x"] - sim["u_x"], 0.4], rtol=1e-8)
        sim.step({"F": -3.0 * sim["x"] - sim["u_x"], "wind": 0.4})

        def rates(t: float, x: np.ndarray, held: np.ndarray = held) -> np.ndarray:
            found = f(t, x[:2].copy(), x[2:].copy(), inputs=held)
            return np.concatenate([found.qdot, found.udot])

        x = solve_ivp(rates, (0.05 * k, 0.05 * (k + 1)), x, rtol=1e-11, atol=1e-11).y[:, -1]
        assert np.allclose(x, [*sim.q, *sim.u], rtol=0, atol=1e-9)


def test_until_it_is_given_an_input_follows_its_expression(cart: mbs.Prepared) -> None:
    """Within steps, as in a whole run; once given it is held, each of many by itself, until a system begins again."""
    whole, sim, many = cart.run(t_end=0.2), cart.stepper(0.02), cart.stepper(0.02, count=2)
    assert sim.inputs == ("F", "wind")
    assert sim.held.tolist() == [2.0 - 0.25, 0.0]
    for _ in range(10):
        sim.step()
    end = [whole["x"][-1], whole["phi"][-1]]
    assert np.allclose(sim.q, end, rtol=1e-13)
    F = 2.0 * np.cos(0.6) - sim["x"]
    assert (sim["F"], sim.held[0]) == (pytest.approx(F, rel=1e-14), sim["F"])
    held = cart.stepper(0.02).step({"F": 1.75, "wind": 0.0})
    assert abs(held.step()["x"] - cart.run(t_end=0.04)["x"][-1]) > 1e-8
    assert held["F"] == 1.75
    many.step({"wind": 0.0}).reset(rows=[0], inputs={"F": 1.75})
    for _ in range(9):
        many.step()
    assert np.allclose(many.q[1], end, rtol=1e-13)
    assert many["F"].tolist() == [1.75, pytest.approx(F)]
    held.restore(sim.state).step()
    assert np.allclose(held.q, sim.step().q, rtol=0, atol=0)


def test_many_have_the_bits_of_each_alone(cart: mbs.Prepared) -> None:
    rng = np.random.default_rng(0)
    given = rng.standard_normal((6, 5, 2))
    many = [cart.stepper(0.02, count=5), cart.stepper(0.02, count=5, threads=2)]
    python = mbs.prepare(cart.system, method="rk4", step="2 ms", backend="python").stepper(0.02)
    alone = [cart.stepper(0.02) for _ in range(5)]
    for inputs in given:
        for sim in many:
            sim.step(inputs)
        python.step(inputs[0])
        for sim, own in zip(alone, inputs, strict=True):
            sim.step(own)
    for sim in many:
        assert sim.t.tolist() == [one.t for one in alone]
        assert np.array_equal(sim.q, [one.q for one in alone])
        assert np.array_equal(sim.u, [one.u for one in alone])
        assert sim["tip"].tolist() == [one["tip"] for one in alone]
    assert np.array_equal(python.q, alone[0].q)


def test_a_state_is_gone_on_from(cart: mbs.Prepared) -> None:
    sim = cart.stepper(0.02, count=2).step([1.0, 0.0])
    state, other = sim.state, sim.copy()
    first = [sim.step().q for _ in range(3)]
    assert np.array_equal(first, [other.step().q for _ in range(3)])
    again = sim.restore(state)
    assert again.t.tolist() == [0.02] * 2
    assert again.held.tolist() == [[1.0, 0.0]] * 2
    assert np.array_equal(first, [again.step().q for _ in range(3)])
    one = cart.stepper(0.02).step([1.0, 0.0])
    assert np.array_equal(first, [x.step().q for x in [sim.restore(one.state)] for _ in range(3)])


def test_begun_again(cart: mbs.Prepared) -> None:
    sim = cart.stepper(0.02, count=3)
    start = sim.q
    sim.step([5.0, 0.0])
    sim.reset(initial={"phi": "10 deg"}, parameters={"f": 7}, rows=[1])
    assert sim.t.tolist() == [0.02, 0.0, 0.02]
    assert sim.q[1].tolist() == [0.25, pytest.approx(np.pi / 18)]
    assert sim.held[1].tolist() == [7.0 - 0.25, 0.0]
    assert sim.held[0].tolist() == [5.0, 0.0]
    before = sim.state
    with pytest.raises(mbs.InputError, match="finite"):
        sim.reset(initial={"x": 1}, inputs=[np.nan, 0.0])
    assert np.array_equal(sim.q, before.q)
    assert sim.t.tolist() == before.t.tolist()
    sim.reset(rows=[2, 0], inputs=[[1.0, 2.0], [3.0, 4.0]])
    assert sim.held[[2, 0]].tolist() == [[1.0, 2.0], [3.0, 4.0]]
    sim.reset(inputs={"wind": [1.0, 2.0, 3.0]})
    assert np.array_equal(sim.q, start)
    assert sim.held.tolist() == [[1.75, w] for w in (1.0, 2.0, 3.0)]


@pytest.mark.parametrize(
    ("text", "names"), [(CART, {"phi": [0.1, 0.2, 0.3], "u_x": [1, 2, 3]}), (BLOCK, {"u_x": [0, 1, 2]})]
)
def test_each_begins_from_its_own_numbers(text: str, names: dict[str, list[float]]) -> None:
    """Starts of three in one call have the bits of each begun alone; so have parameters, of which inputs are made."""
    prepared = mbs.prepare(mbs.loads(text), method="rk4", step="2 ms")
    many, alone = prepared.stepper(0.02, count=4), prepared.stepper(0.02)
    columns = {"f": [1.0, 2.0, 3.0]} if text is CART else {}
    for parameters in ({}, columns):
        many.reset(rows=[0, 3, 1], initial=dict(names), parameters=parameters).step()
        for k, row in enumerate((0, 3, 1)):
            own = {name: values[k] for name, values in names.items()}
            alone.reset(initial=own, parameters={name: values[k] for name, values in parameters.items()}).step()
            assert np.array_equal(many.q[row], alone.q)
            assert np.array_equal(many.u[row], alone.u)
            assert np.array_equal(many.held[row], alone.held)
    with pytest.raises(mbs.InputError, match=r"initial\['u_x'\] has the shape \(3,\), not a number or \(4,\)"):
        many.reset(initial={"u_x": [0, 1, 2]})


def test_a_stop_ends_it(cart: mbs.Prepared) -> None:
    whole = cart.run(inputs={"F": 30.0}, t_end=5)
    assert whole.stop is not None
    sim = cart.stepper(0.1, count=2)
    while sim.stop[0] is None:
        sim.step(np.array([[30.0, 0.0], [0.0, 0.0]]))
    assert sim.stop == [{"t": sim.t[0], "kind": "stop", "element": "far"}, None]
    assert sim.t[0] == pytest.approx(whole.t_final, rel=1e-9)
    assert sim.q[0, 0] == pytest.approx(2.0, rel=1e-9)
    at = sim.state
    sim.step()
    assert np.array_equal(sim.q[0], at.q[0])  # it stays there, and the other one goes on
    assert sim.t[1] > at.t[1]
    assert sim.t[0] == at.t[0]
    one = cart.stepper(0.1)
    while one.stop is None:
        one.step([30.0, 0.0])
    with pytest.raises(mbs.InputError, match="far has stopped the motion: reset it, or restore a state"):
        one.step()
    assert one.reset().step().stop is None


@pytest.mark.parametrize("dt", [0.1, 0.05])
def test_contacts_stick_and_slide_on(block: mbs.Prepared, dt: float) -> None:
    """As in a run whose input jumps at the same times."""
    whole, sim, events = block.run(), block.stepper(dt), list[dict[str, Any]]()
    for _ in range(round(1.5 / dt)):
        events += sim.step([push(sim.t)]).events
        k = round(sim.t / 0.05)
        assert np.allclose(sim.q, [whole["x"][k], whole["y"][k]], rtol=0, atol=1e-8)
    assert [(e["kind"], e["element"]) for e in events] == [("slide+", "c"), ("stick", "c")]
    assert np.allclose([e["t"] for e in events], [e["t"] for e in whole.events], rtol=1e-8)
    assert sim["friction"] == pytest.approx(2.0)


def test_contacts_of_many_and_their_states(block: mbs.Prepared) -> None:
    sim = block.stepper(0.1, count=3)
    for _ in range(4):
        sim.step([[3.0], [8.0], [-2.0]])
    assert np.allclose(sim["friction"], [-3.0, -0.4 * 9.81, 2.0])
    assert np.allclose(sim["x"], [0.0, (8.0 - 0.4 * 9.81) * 0.4**2 / 2, 0.0])
    state = sim.state
    first = [sim.step([[-3.0], [-3.0], [-3.0]]).q for _ in range(12)]
    assert "stick" in {change["kind"] for change in _all_events(sim.restore(state), 12)}
    other = sim.restore(state).copy()
    assert np.array_equal(first, [other.step([[-3.0], [-3.0], [-3.0]]).q for _ in range(12)])


def _all_events(sim: Any, steps: int) -> list[dict[str, Any]]:
    return [event for _ in range(steps) for row in sim.step([-3.0]).events for event in row]


def test_what_bounces_without_inputs_or_with_two() -> None:
    """A slider between stops, of mass 1, pushed by F + G: against a run, and a motion that begins with an impact."""
    rail = mbs.Prismatic("ground", "b", axis="x", q="x", limits=mbs.Limits(lower=-1, upper=1))
    push = mbs.Force("b", [mbs.variable("F") + mbs.variable("G"), 0, 0])
    parts = {"bodies": {"b": mbs.Body(mass=1)}, "joints": {"j": rail}, "forces": {"f": push}}
    system = mbs.System("stops", inputs={"F": 0, "G": 1}, **parts)
    whole = mbs.simulate(system, inputs={"F": 2}, t_end=1.2, samples=13)
    for held in (None, "F", ()):
        sim = mbs.prepare(system, inputs=None if held != () else {"F": 2}).stepper(0.1, inputs=held)
        events = list(sim.events)
        for _ in range(12):
            events += sim.step({"F": 2.0} if sim.inputs else None).events
        assert sim["x"] == pytest.approx(whole["x"][-1], abs=1e-8)
        assert [e["kind"] for e in events] == [e["kind"] for e in whole.events]
        assert sim.step().events == []
        other = sim.copy()
        assert [other.step().q for _ in range(3)] == [sim.step().q for _ in range(3)]
        assert other.t == sim.t


def test_inputs_that_drive_motions_are_not_held() -> None:
    """A speed that a constraint prescribes would jump where a held value does."""
    parts = {"bodies": {"b": mbs.Body(mass=1)}, "joints": {"j": mbs.Prismatic("ground", "b", axis="x", q="x")}}
    drive = mbs.VelocityConstraint(zero="u_x - v")
    system = mbs.System("driven", inputs={"v": "0.5*t", "F": 0}, constraints={"drive": drive}, **parts)
    prepared = mbs.prepare(system, initial={"u_x": 0})
    with pytest.raises(mbs.InputError, match="v drives a motion or a constraint"):
        prepared.stepper(0.1, inputs=["v"])
    sim = prepared.stepper(0.1)
    assert sim.inputs == ("F",)
    assert sim.step().step()["x"] == pytest.approx(0.25 * 0.04, rel=1e-6)


def test_a_held_input_finds_a_name_that_nothing_has() -> None:
    rail = mbs.Prismatic("ground", "b", axis="x", q="held_F")
    push = mbs.Force("b", [mbs.variable("F"), 0, 0])
    parts = {"bodies": {"b": mbs.Body(mass=1)}, "joints": {"j": rail}, "forces": {"f": push}}
    sim = mbs.prepare(mbs.System("names", inputs={"F": 0}, **parts)).stepper(1.0)
    assert sim.step([3.0])["held_F"] == pytest.approx(1.5)


def test_a_held_input_may_divide() -> None:
    """Until a step gives it, it has the value of its expression: none is zero on the way there."""
    table = {"table": [[0, 2], [1, 4]], "of": "x"}
    system = mbs.System(
        "slider",
        gravity=[0, 0, 0],
        bodies={"body": mbs.Body(mass=1)},
        joints={"rail": mbs.Prismatic("ground", "body", axis="x", q="x")},
        inputs={"F": "4 - 2*cos(t)", "G": table},
        forces={"push": mbs.Force("body", [mbs.variable("G") / mbs.variable("F"), 0, 0])},
    )
    sim = mbs.prepare(system).stepper(0.5)
    assert sim.held.tolist() == [2.0, 2.0]
    assert sim.step({"F": 4, "G": 8})["x"] == pytest.approx(0.25, rel=1e-12)


def test_loops_stay_closed() -> None:
    prepared = mbs.prepare(mbs.loads(FOUR_BAR))
    sim, whole = prepared.stepper(0.01), prepared.run(t_end=0.3, samples=4)
    for _ in range(30):
        sim.step()
    assert np.allclose(sim.q, [whole[name][-1] for name in ("a", "b", "c")], rtol=0, atol=1e-6)
    a, b, c = sim.q
    ends = [0.3 * np.exp(1j * a) + 0.8 * np.exp(1j * (a + b)), 0.9 + 0.6 * np.exp(1j * c)]
    assert abs(ends[0] - ends[1]) < 1e-9


def test_a_step_that_fails_changes_nothing() -> None:
    """A bead on a spring whose rate has a pole, which the larger push reaches."""
    system = mbs.System(
        "pole",
        bodies={"bead": mbs.Body(mass=1)},
        joints={"rail": mbs.Prismatic("ground", "bead", axis="x", q="x")},
        forces={"push": mbs.Force("bead", [mbs.variable("F") + 1e-3 / (1 - mbs.variable("x")) ** 2, 0, 0])},
        inputs={"F": 0},
    )
    prepared = mbs.prepare(system)
    sim, many = prepared.stepper(0.5), prepared.stepper(0.5, count=2)
    before = sim.step([1.0]).state
    with pytest.raises(mbs.RunError):
        sim.step([1e3])
    assert sim.t == before.t
    assert np.array_equal(sim.q, before.q)
    assert sim.held.tolist() == [1.0]
    many.step([1.0])
    with pytest.raises(mbs.RunError, match="system 1"):
        many.step([[1.0], [1e3]])
    assert many.t.tolist() == [0.5] * 2
    assert np.array_equal(many.q[0], before.q)
    assert np.array_equal(many.step().q[0], sim.step().q)


def test_a_text_with_its_unit_and_a_mask_are_read(cart: mbs.Prepared) -> None:
    many = cart.stepper("20 ms", count=3).step({"F": "2 kN", "wind": "3"})
    assert many.held.tolist() == [[2000.0, 3.0]] * 3
    many.reset(rows=many.q[:, 0] > np.inf).reset(rows=np.array([True, False, True]), inputs={"wind": "5 N"})
    assert many.t.tolist() == [0.0, 0.02, 0.0]
    assert many.held[:, 1].tolist() == [5.0, 3.0, 5.0]


def test_wrong_words_are_told(cart: mbs.Prepared) -> None:
    sim, many = cart.stepper(0.1), cart.stepper(0.1, count=2)
    for call, message in (
        (lambda: cart.stepper(0), "dt"),
        (lambda: cart.stepper("1 m"), "dt"),
        (lambda: cart.stepper(0.1, inputs=["G"]), "there is no input 'G'"),
        (lambda: cart.stepper(0.1, count=0), "count is a number of at least 1, not 0"),
        (lambda: cart.stepper(0.1, threads=1.5), "threads is a number of at least 1, not 1.5"),
        (lambda: sim.step([1.0]), r"inputs has the shape \(1,\), not \(2,\): F, wind"),
        (lambda: sim.step({"G": 1.0}), "there is no input 'G'"),
        (lambda: sim.step({"F": [1.0, 2.0]}), r"inputs\['F'\] has the shape \(2,\), not a number"),
        (lambda: sim.step([np.nan, 0.0]), r"inputs is to be finite, got \[nan, 0.0\]"),
        (lambda: sim.step({"F": np.inf}), r"inputs\['F'\] is to be finite"),
        (lambda: sim.step([1e308, 0.0]), r"inputs is too large to compute with, got \[1e\+308, 0.0\]: at most 1e\+150"),
        (lambda: sim.step("F"), "inputs is to be real numbers"),
        (lambda: many.step(np.zeros((3, 2))), r"inputs has the shape \(3, 2\), not \(2,\) or \(2, 2\)"),
        (lambda: sim.step({"F": "2 m"}), r"^inputs\.F: '2 m' does not fit here"),
        (lambda: many.reset(initial={"phi": [1, 2, 3]}), r"initial\['phi'\] has the shape \(3,\), not a number or"),
        (lambda: many.reset(initial={"phi": [1, np.nan]}), r"initial\['phi'\] is to be finite"),
        (lambda: many.reset(rows=[True]), "rows has 1 times True or False for 2 systems"),
        (lambda: many.reset(rows=[2]), "rows has 2; they are numbers from 0 to 1"),
        (lambda: many.reset(rows=1), "rows is a list of numbers, not 1"),
        (lambda: cart.stepper(0.1, inputs="F").step({"wind": 1}), "the input 'wind' is not held"),
        (lambda: sim.reset(initial={"psi": 1}), "psi"),
        (lambda: sim["psi"], "nothing here is called 'psi'"),
        (lambda: sim.restore(many.state), "the state is that of 2 systems, not 1"),
        (lambda: sim.restore(cart.stepper(0.1, inputs="F").state), "the state is that of another system"),
        (lambda: sim.step([1.0, 0.0], 2), "step"),  # type: ignore[call-arg]
        (lambda: sim.restore(3), "state is what `state` of a Stepper returned, not 3"),  # type: ignore[arg-type]
    ):
        with pytest.raises(mbs.InputError, match=message):
            call()
