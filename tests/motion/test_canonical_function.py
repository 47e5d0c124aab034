"""Hamilton's equations as compiled functions: the rates, motions and H that other formalisms give, in linear time."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state
from scipy.integrate import solve_ivp
from textbook import cart_pole, double_pendulum, elastic_pendulum, hanging_mass, pendulum_in_xy, top

import multibody_sym as mbs
from multibody_sym.dynamics.conserved import candidates
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.state_functions import canonical_programs
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, coordinate_rates
from multibody_sym.program.program import interpret, operation_count
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> Callable[[], mbs.System]:
    return lambda: mbs.load(EXAMPLES / f"{name}.yaml")


def momenta_and_rates(mechanism: Mechanism, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Return p and pdot by composite bodies and the chain rule along the motion."""
    found = forward_dynamics(composite_body(mechanism, state))
    parts = [x for x in candidates(mechanism) if x.kind == "speed"]
    known = {**state.slots, **{slot("udot", k): x for k, x in enumerate(found.udot.tolist())}}
    values = np.array(evaluate_float([y for x in parts for y in (x.value, x.rate)], known)).reshape(-1, 2)
    return values[:, 0], values[:, 1]


def close(found: Any, expected: Any, size: float = 1e-11) -> bool:
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return bool(np.all(np.abs(found - expected) <= size * (1 + np.abs(expected).max(initial=0.0))))


# --- rates -----------------------------------------------------------------------------------------------------------


def verify_rates(case: Case, t: float, q: Any, u: Any) -> None:
    """Compare what the Programs give, interpreted, with the rates of momenta by other routes.

    Speeds that come back from momenta of masses from 1e-3 to 1e3 are looked at by the momenta that they have.
    """
    programs, parameters = canonical_programs(case.mechanism), case.parameters
    (inputs,) = interpret(programs["inputs"], t, q, u, parameters)
    p, _ = momenta_and_rates(case.mechanism, case.state(t, q, u))
    (found,) = interpret(programs["momenta"], t, q, u, parameters, inputs, [])
    assert close(found, p)
    (speeds,) = interpret(programs["speeds"], t, q, found, parameters, inputs, [])
    (inputs,) = interpret(programs["inputs"], t, q, speeds, parameters)
    again, pdot = momenta_and_rates(case.mechanism, case.state(t, list(q), speeds.tolist()))
    assert close(again, p)
    qdot, rates, _ = interpret(programs["canonical"], t, q, found, parameters, inputs, [])
    assert close(qdot, coordinate_rates(case.mechanism, list(q), speeds.tolist()))
    assert close(rates, pdot, 1e-10)


@pytest.mark.parametrize("count", [12, pytest.param(120, marks=pytest.mark.long)])
@pytest.mark.parametrize("rows", [False, True])
def test_rates_of_random_systems(count: int, rows: bool) -> None:
    compared = 0
    for seed in range(1000):
        case = random_case(seed, bodies=(1, 4), rows=rows)
        if massless_speeds(case.mechanism):
            continue
        t, q, u = random_state(np.random.default_rng(seed), case)
        verify_rates(case, t, q, u)
        compared += 1
        if compared == count:
            break
    assert compared == count


# --- motions ---------------------------------------------------------------------------------------------------------

MOTIONS = {
    "double_pendulum": (double_pendulum, {"q1": 1.0, "q2": 0.5}),
    "cart_pole": (cart_pole, {"theta": 0.7}),
    "elastic_pendulum": (elastic_pendulum, {"theta": 0.7}),
    "top": (top, {"ball_wz": 9.0, "ball_wx": 0.4}),
    "rod in x and y": (pendulum_in_xy, {}),
    "kepler": (example("kepler"), {}),
    "driven rotor": (example("shaken_rotor"), {}),
    "sleigh": (example("chaplygin_sleigh"), {}),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_are_those_of_lagrange(name: str) -> None:
    """Coordinates along a run, and H: constant where it is said to be, to 1e-10."""
    build, initial = MOTIONS[name]
    system = build()
    t_end = 0.6
    run = mbs.simulate(
        system, t_end=t_end, samples=5, initial=initial, rtol=1e-12, atol=1e-13, method="dormand_prince_8",
        backend="python",
    )  # fmt: skip
    rhs = mbs.compile(mbs.canonical_equations(changed(system, initial)), backend="python")
    found = solve_ivp(rhs, (0, t_end), rhs.x0, "DOP853", t_eval=run.t, rtol=1e-12, atol=1e-13)
    names = rhs.names[: len(rhs.q0)]
    for k, coordinate in enumerate(names):
        assert np.abs(found.y[k] - run[coordinate]).max() < 1e-9, coordinate
    H = np.array([rhs.hamiltonian(t, x) for t, x in zip(found.t, found.y.T, strict=True)])
    if name not in ("cart_pole", "elastic_pendulum", "driven rotor"):
        assert np.ptp(H) <= 1e-10 * max(1.0, np.abs(H).max())


def changed(system: mbs.System, initial: dict[str, float]) -> mbs.System:
    from multibody_sym.mechanics.changes import Overrides

    return Overrides(None, initial or None, None, None, None).of(system)


@pytest.mark.parametrize("backend", ["python", "c"])
def test_momenta_and_speeds_are_inverse(backend: Any) -> None:
    rhs = mbs.compile(mbs.canonical_equations(mbs.load(EXAMPLES / "furuta.yaml")), backend=backend)
    u = np.array([0.3, -0.8])
    p = rhs.momenta(0.0, rhs.q0, u)
    assert rhs.speeds(0.0, rhs.q0, p) == pytest.approx(u, rel=1e-13)
    assert rhs.names == ("phi", "theta", "p_phi", "p_theta")
    assert rhs(0.0, rhs.x0).shape == (4,)


def test_parameters_and_inputs_are_given_anew() -> None:
    system = cart_pole()
    rhs = mbs.compile(mbs.canonical_equations(system), backend="python")
    x = [0.1, 0.4, 0.2, 0.3]
    assert rhs(0.0, x, inputs={"F": 5.0})[2] == pytest.approx(5.0)
    heavy = rhs(0.0, x, parameters={"M": 100.0})
    assert abs(heavy[0]) < abs(rhs(0.0, x)[0])
    with pytest.raises(mbs.InputError):
        rhs(0.0, [1.0])
    with pytest.raises(mbs.InputError, match="no input"):
        rhs(0.0, x, inputs={"G": 1.0})
    again = pickle.loads(pickle.dumps(rhs))
    assert again(0.0, x) == pytest.approx(rhs(0.0, x))


def test_what_has_no_canonical_equations_says_so() -> None:
    rubbing = mbs.System(
        "slides",
        gravity=[0, -9.81, 0],
        bodies={"box": mbs.Body(mass=1)},
        joints={"J": mbs.Prismatic("ground", "box", axis="x", q="x", initial={"u": 1})},
        forces={"f": mbs.Friction("J", kinetic=0.2)},
    )
    with pytest.raises(mbs.ModelError, match="rubs or slides"):
        mbs.compile(mbs.canonical_equations(rubbing))
    with pytest.raises(mbs.ModelError, match="varies"):
        mbs.compile(mbs.canonical_equations(mbs.load(EXAMPLES / "variable_mass" / "rocket.yaml")))
    hanging = mbs.compile(mbs.canonical_equations(hanging_mass()), backend="python")
    assert hanging(0.0, hanging.x0) == pytest.approx([0.0, 0.0], abs=1e-12)


# --- size ------------------------------------------------------------------------------------------------------------


def spatial_chain(links: int) -> mbs.System:
    body = mbs.Body(
        mass=1.5, com=[0.1, -0.4, 0.2], inertia=[0.1, 0.2, 0.15, 0.01, 0.02, 0.03], points={"end": [0.1, -1, 0]}
    )
    parents = ["ground", *(f"b{k}.end" for k in range(links - 1))]
    return mbs.System(
        "spatial",
        gravity=[0, -9.81, 0],
        bodies={f"b{k}": body for k in range(links)},
        joints={f"j{k}": mbs.Spherical(parents[k], f"b{k}") for k in range(links)},
    )


def test_programs_grow_with_the_number_of_bodies() -> None:
    """So many more operations from 8 to 12 links as from 4 to 8, in each Program."""
    counts = []
    for links in (4, 8, 12):
        programs = canonical_programs(mbs.mechanism(spatial_chain(links)))
        counts.append({name: operation_count(x).total for name, x in programs.items() if name != "inputs"})
    for name in counts[0]:
        first, second = (counts[k + 1][name] - counts[k][name] for k in (0, 1))
        assert second == pytest.approx(first, rel=0.02), name
