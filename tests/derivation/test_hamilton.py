"""Hamilton's and Routh's equations against books, and against the rates of momenta that other formalisms give."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from mechanisms import random_case, random_state
from test_routh import turning_hoop
from textbook import (
    cart_pole,
    chain,
    double_pendulum,
    elastic_pendulum,
    hanging_mass,
    pendulum,
    pendulum_in_xy,
    positive,
    spherical_pendulum,
    top,
)

import multibody_sym as mbs
from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions
from multibody_sym.cli.main import main
from multibody_sym.derivation.canonical import hamilton
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.lagrange import energies
from multibody_sym.derivation.prepare import prepare
from multibody_sym.derivation.symbolic_equations import CanonicalEquations
from multibody_sym.dynamics.conserved import candidates
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, coordinate_rates, state_of
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot

EXAMPLES = Path(__file__).parents[2] / "examples"


def by_name(equations: CanonicalEquations) -> dict[str, Any]:
    s = equations.symbols
    return {x.name: x for group in (s.coordinates, s.speeds, s.parameters, equations.momenta) for x in group}


def canonical(system: Any, method: str = "hamilton") -> CanonicalEquations:
    found = derive(system, method)
    assert isinstance(found, CanonicalEquations)
    return found


# --- books -----------------------------------------------------------------------------------------------------------

BOOK: dict[Callable[[], mbs.System], str] = {
    pendulum: "p_theta^2/(2*m*l^2) - m*g*l*cos(theta)",
    elastic_pendulum: "p_theta^2/(2*m*r^2) + p_r^2/(2*m) + k*(r - r0)^2/2 - m*g*r*cos(theta)",
    spherical_pendulum: "p_phi^2/(2*m*l^2*sin(theta)^2) + p_theta^2/(2*m*l^2) - m*g*l*cos(theta)",
}


@pytest.mark.parametrize("system", BOOK, ids=lambda system: system.__name__)
def test_hamiltons_functions_are_those_of_books(system: Callable[[], mbs.System]) -> None:
    equations = canonical(system())
    assert equations.notation.text(equations.function) == BOOK[system]


def test_canonical_equations_of_the_pendulum() -> None:
    assert str(canonical(pendulum())) == "theta' = p_theta/(m*l^2)\np_theta' = -m*g*l*sin(theta)"


def test_double_pendulum() -> None:
    """Relative angles; H of absolute ones is in every book: p1 = p_q1 - p_q2, p2 = p_q2, theta2 = q1 + q2."""
    equations = canonical(double_pendulum())
    s = by_name(equations)
    m1, m2, l1, l2, g = (s[x] for x in ("m1", "m2", "l1", "l2", "g"))
    p1, p2 = s["p_q1"] - s["p_q2"], s["p_q2"]
    a, b = s["q1"], s["q1"] + s["q2"]
    kinetic = (m2 * l2**2 * p1**2 + (m1 + m2) * l1**2 * p2**2 - 2 * m2 * l1 * l2 * p1 * p2 * sympy.cos(s["q2"])) / (
        2 * m2 * l1**2 * l2**2 * (m1 + m2 * sympy.sin(s["q2"]) ** 2)
    )
    book = kinetic - (m1 + m2) * g * l1 * sympy.cos(a) - m2 * g * l2 * sympy.cos(b)
    assert sympy.simplify(equations.function - book) == 0
    assert not equations.definitions


def test_the_top_by_quaternions_has_poincares_equations() -> None:
    equations = canonical(top())
    note = next(step.note for step in equations.steps if step.title == "Canonical equations")
    assert "Poincare" in note
    s = by_name(equations)
    A, C = s["A"] + s["m"] * s["l"] ** 2, s["C"]
    px, pz = s["p_ball_wx"], s["p_ball_wz"]
    without_weight = equations.rates[1][1].subs(s["g"], 0)
    assert sympy.simplify(without_weight - (px * pz / A - px * pz / C)) == 0  # -(omega x p)_y


def test_a_driven_hoop_has_a_function_that_is_not_the_energy() -> None:
    equations = canonical(turning_hoop(driven=True))
    note = next(step.note for step in equations.steps if step.title == "Hamilton's function")
    assert "is not the energy" in note
    assert "constant" in note
    names = {x.name: x.expression for x in equations.first_integrals}
    assert names == {"jacobi_integral()": equations.function}
    assert equations.energy is None


def test_what_is_said_of_the_function() -> None:
    def note(system: mbs.System) -> str:
        return next(step.note for step in canonical(system).steps if step.title == "Hamilton's function")

    assert note(pendulum()) == "H = T + V; it is constant"
    assert note(cart_pole()) == "H = T + V; its rate is Q u"
    timed = mbs.System(
        "timed",
        bodies={"p": mbs.Body(mass=1)},
        joints={"j": mbs.Prismatic("ground", "p", axis="x", q="x")},
        forces={"v": mbs.Potential("sin(t)*x", joint="j")},
    )
    assert note(timed) == "H = T + V; its rate is dH/dt at constant q and p"


# --- against other formalisms ----------------------------------------------------------------------------------------


def parameters(mechanism: Mechanism) -> list[float]:
    return list(parameter_values(mechanism, {}))


def rates_by_lagrange(mechanism: Mechanism, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return p, pdot, udot and multipliers, by composite bodies and the chain rule along the motion."""
    found = forward_dynamics(composite_body(mechanism, state))
    parts = [x for x in candidates(mechanism) if x.kind == "speed"]
    known = {**state.slots, **{slot("udot", k): x for k, x in enumerate(found.udot.tolist())}}
    values = np.array(evaluate_float([y for x in parts for y in (x.value, x.rate)], known)).reshape(-1, 2)
    return values[:, 0], values[:, 1], np.array(found.udot), np.array(found.multipliers)


def close(found: Any, expected: Any, size: float = 1e-11) -> bool:
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return bool(np.all(np.abs(found - expected) <= size * (1 + np.abs(expected).max(initial=0.0))))


_ROUNDINGS = 8
"""How many roundings the speeds and p' may show, each as large as the condition of M, or terms that cancel, make it."""


def verify_hamilton(equations: CanonicalEquations, state: State, parameters: Any) -> None:
    """Assert that q' and p' are those of Lagrange's equations, at the speeds that q' tells, and that these have the p.

    So nothing is asked of p = M u + b solved for u but a small residual: with a condition of 1e7 of M rounding in p
    alone changes u by more than 1e-11. The speeds themselves are asked for as well as the condition lets, p' as well as
    Lagrange's has it, in whose M u' terms of |M| |u'| may cancel.
    """
    mechanism = equations.mechanism
    p, _, _, _ = rates_by_lagrange(mechanism, state)
    t = state.slots[slot("t", 0)]
    qdot, rate = equations.lambdify()(state.q, p, t, parameters)
    units = np.eye(len(state.u))
    kinematics = np.array([coordinate_rates(mechanism, state.q, list(unit)) for unit in units], dtype=float).T
    u = np.linalg.lstsq(kinematics, np.asarray(qdot, dtype=float), rcond=None)[0]
    assert close(qdot, kinematics @ u)
    moving = state_of(mechanism, float, t, state.q, u.tolist(), parameters)
    told, told_rate, udot, _ = rates_by_lagrange(mechanism, moving)
    M = np.array(composite_body(mechanism, state).mass_matrix, dtype=float)
    rounding = _ROUNDINGS * float(np.finfo(float).eps)
    assert close(told, p)
    cancelling = float((np.abs(M) @ np.abs(udot)).max(initial=0.0))
    assert close(rate, told_rate, 1e-11 + rounding * cancelling / (1 + np.abs(told_rate).max(initial=0.0)))
    assert close(u, state.u, 1e-11 + rounding * float(np.linalg.cond(M)))


TEXTBOOK = [
    pendulum, cart_pole, elastic_pendulum, double_pendulum, spherical_pendulum, top,
    lambda: turning_hoop(driven=True), lambda: turning_hoop(driven=False),
]  # fmt: skip


@pytest.mark.parametrize("build", TEXTBOOK)
def test_rates_along_runs_are_those_of_lagrange(build: Callable[[], mbs.System]) -> None:
    system = build()
    equations = canonical(system)
    mechanism = equations.mechanism
    given = parameters(mechanism)
    initial = {x.name: 0.3 + 0.1 * k for k, x in enumerate(mechanism.speeds)}
    initial |= {"theta": 0.4} if any(c.name == "theta" for c in mechanism.coordinates) else {}
    run = mbs.simulate(system, t_end=2, samples=6, initial=initial, rtol=1e-10, atol=1e-12)
    for k in range(len(run.t)):
        q = [run[c.name][k] for c in mechanism.coordinates]
        u = [run[s.name][k] for s in mechanism.speeds]
        state = state_of(mechanism, float, float(run.t[k]), q, u, given)
        verify_hamilton(equations, state, given)


def random_trees(wanted: int) -> Any:
    found = 0
    for seed in range(200):
        case = random_case(seed, bodies=(1, 2))
        if massless_speeds(case.mechanism) or len(case.mechanism.speeds) > 7:
            continue
        if any(p.value is None for p in case.mechanism.parameters):
            continue
        yield seed, case
        found += 1
        if found == wanted:
            return


@pytest.mark.parametrize("wanted", [4, pytest.param(40, marks=pytest.mark.long)])
def test_random_trees_of_all_joints_and_forces(wanted: int) -> None:
    for seed, case in random_trees(wanted):
        t, q, u = random_state(np.random.default_rng(seed), case)
        equations = canonical(case.mechanism)
        given = parameters(case.mechanism)
        verify_hamilton(equations, state_of(case.mechanism, float, t, list(q), list(u), given), given)


def test_a_tree_whose_masses_lie_far_apart() -> None:
    """The condition of M is 8e6: p and p' are right to 1e-11 all the same, at the speeds that q' tells."""
    seed, case = next((seed, case) for seed, case in random_trees(40) if seed == 17)
    t, q, u = random_state(np.random.default_rng(seed), case)
    given = parameters(case.mechanism)
    state = state_of(case.mechanism, float, t, list(q), list(u), given)
    assert np.linalg.cond(np.array(composite_body(case.mechanism, state).mass_matrix, dtype=float)) > 1e6
    verify_hamilton(canonical(case.mechanism), state, given)


def test_written_out_and_named_forms_agree() -> None:
    for system in (double_pendulum(), turning_hoop(driven=False), cart_pole()):
        ready = prepare(system, Overrides())
        names = Subexpressions(ready.symbols.free_prefix, Budget())
        named = hamilton(ready, names, energies(ready.mechanism, ready.symbols, names))
        given = parameters(ready.mechanism)
        n = len(ready.mechanism.coordinates)
        state = state_of(
            ready.mechanism, float, 0.2, [0.3 + 0.2 * k for k in range(n)], [0.7 - k for k in range(n)],
            given,
        )  # fmt: skip
        verify_hamilton(named, state, given)


def test_a_chain_gets_names() -> None:
    equations = canonical(chain([f"m{k}" for k in range(5)], [f"l{k}" for k in range(5)]))
    assert equations.definitions
    mechanism = equations.mechanism
    given = parameters(mechanism)
    state = state_of(mechanism, float, 0.0, [0.3, -0.2, 0.5, 0.1, 0.9], [0.5, 1, -0.3, 0.2, 0.4], given)
    verify_hamilton(equations, state, given)


def folded() -> mbs.System:
    """A pendulum in a plane whose cut joint has rows in space, of which some vanish."""
    return mbs.System(
        "folded",
        bodies={
            "a": mbs.Body(mass=1, com=[0.5, 0, 0], points={"end": [1, 0, 0]}),
            "b": mbs.Body(mass=1, inertia={"Izz": 0.1}),
        },
        joints={
            "A": mbs.Revolute("ground", "a", axis="z", q="a"),
            "B": mbs.Planar("ground", "b", q=["x", "y", "b"], initial={"q": [1, 0, 0]}),
            "C": mbs.Spherical("a.end", "b", cut=True),
        },
    )


CONSTRAINED = [pendulum_in_xy, hanging_mass, folded, lambda: mbs.load(EXAMPLES / "chaplygin_sleigh.yaml")]


@pytest.mark.parametrize("build", CONSTRAINED)
def test_constraints_have_multipliers(build: Callable[[], mbs.System]) -> None:
    """p' with the multipliers of composite bodies put in is the rate of p; constraints hold in q, p."""
    equations = canonical(build())
    mechanism, s = equations.mechanism, equations.symbols
    begin = start(mechanism)
    state = state_of(mechanism, float, 0.0, list(begin.q), list(begin.u), list(begin.parameters))
    p, pdot, _, multipliers = rates_by_lagrange(mechanism, state)
    given: Mapping[Any, float] = {
        **dict(zip(s.coordinates, state.q, strict=True)),
        **dict(zip(equations.momenta, p, strict=True)),
        **dict(zip(s.parameters, begin.parameters, strict=True)),
        **dict(zip(s.multipliers, multipliers, strict=True)),
        s.time: 0.0,
    }
    n, m = len(s.coordinates), len(s.speeds)
    rates = [float(equations.explicit(e.right).subs(given)) for e in equations.equations[n : n + m]]
    assert close(rates, pdot)
    assert all(abs(float(equations.explicit(x).subs(given))) < 1e-9 for x in equations.constraints)
    assert not any(e.left == 0 for e in equations.equations)  # a row that vanishes is not told
    with pytest.raises(mbs.ModelError, match="canonical_equations"):
        equations.lambdify()


# --- Routh -----------------------------------------------------------------------------------------------------------


def gimbal() -> mbs.System:
    bodies = {
        "outer": mbs.Body(),
        "inner": mbs.Body(),
        "wheel": mbs.Body(mass="m", com=[0, 0, "l"], inertia={"Ixx": "A", "Iyy": "A", "Izz": "C"}),
    }
    joints = {
        "a": mbs.Revolute("ground", "outer", axis="z", q="psi"),
        "b": mbs.Revolute("outer", "inner", axis="x", q="theta", initial={"q": 0.7}),
        "c": mbs.Revolute("inner", "wheel", axis="z", q="phi"),
    }
    return mbs.System("gimbal", gravity=[0, 0, "-g"], parameters=positive("A C m l"), bodies=bodies, joints=joints)


def test_effective_potential_of_lagranges_top() -> None:
    equations = canonical(gimbal(), "routh")
    assert equations.notation.text(equations.effective_potential) == (
        "(p_phi*cos(theta) - p_psi)^2/(2*(m*l^2 + A)*sin(theta)^2) + p_phi^2/(2*C) + m*g*l*cos(theta)"
    )
    assert [p.name for p in equations.momenta] == ["p_psi", "p_phi"]


def kepler() -> mbs.System:
    return mbs.load(EXAMPLES / "kepler.yaml")


@pytest.mark.parametrize("build", [gimbal, spherical_pendulum, lambda: turning_hoop(driven=False), kepler])
def test_reduced_equations_hold_along_the_motion_of_other_formalisms(build: Callable[[], mbs.System]) -> None:
    equations = canonical(build(), "routh")
    mechanism, s = equations.mechanism, equations.symbols
    values = parameters(mechanism)
    q = [0.4 + 0.3 * k for k in range(len(s.coordinates))]
    u = [0.9 - 0.5 * k for k in range(len(s.speeds))]
    state = state_of(mechanism, float, 0.0, q, u, values)
    p, pdot, udot, _ = rates_by_lagrange(mechanism, state)
    cyclic = [k for k, x in enumerate(s.speeds) if x in equations.speeds]
    assert close([pdot[k] for k in cyclic], [0] * len(cyclic))
    given = {
        **dict(zip(s.coordinates, q, strict=True)),
        **{x: v for k, (x, v) in enumerate(zip(s.speeds, u, strict=True)) if k not in cyclic},
        **dict(zip(s.accelerations, udot.tolist(), strict=True)),
        **dict(zip(equations.momenta, [p[k] for k in cyclic], strict=True)),
        **dict(zip(s.parameters, values, strict=True)),
    }
    assert close([float(x.subs(given)) for x in equations.speeds.values()], [u[k] for k in cyclic])
    kept = len(s.speeds) - len(cyclic)
    for e in equations.equations[:kept]:
        assert close([float(e.left.subs(given))], [float(e.right.subs(given))])


def test_routh_says_why_it_does_not_apply() -> None:
    with pytest.raises(mbs.ModelError, match="no coordinate is cyclic"):
        derive(pendulum(), "routh")
    with pytest.raises(mbs.ModelError, match="independent ones; choose hamilton"):
        derive(hanging_mass(), "routh")


def test_hamilton_says_why_it_does_not_apply() -> None:
    rubbing = mbs.System(
        "slides",
        gravity=[0, -9.81, 0],
        bodies={"box": mbs.Body(mass=1)},
        joints={"J": mbs.Prismatic("ground", "box", axis="x", q="x", initial={"u": 1})},
        forces={"f": mbs.Friction("J", kinetic=0.2)},
    )
    with pytest.raises(mbs.ModelError, match="choose the method multipliers"):
        derive(rubbing, "hamilton")
    massless = mbs.System(
        "arm", bodies={"arm": mbs.Body()}, joints={"J": mbs.Revolute("ground", "arm", axis="z", q="a")}
    )
    with pytest.raises(mbs.MultibodyError, match="mass"):
        derive(massless, "hamilton")
    with pytest.raises(mbs.InputError, match="hamilton, routh"):
        derive(pendulum(), "hamiltonian")
    with pytest.raises(mbs.ModelError, match="varies"):
        derive(mbs.load(EXAMPLES / "variable_mass" / "cayleys_chain.yaml"), "hamilton")


# --- first integrals -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("build", [gimbal, kepler, lambda: turning_hoop(driven=True)])
def test_first_integrals_are_constant_along_runs(build: Callable[[], mbs.System]) -> None:
    system = build()
    equations = canonical(system)
    mechanism, s = equations.mechanism, equations.symbols
    begin = start(mechanism)
    run = mbs.simulate(system, t_end=1, samples=5, rtol=1e-12, atol=1e-13, method="dormand_prince_8")
    assert equations.first_integrals
    for integral in equations.first_integrals:
        value = sympy.lambdify([*s.coordinates, *equations.momenta, *s.parameters], integral.expression)
        found = []
        for k in range(len(run.t)):
            q = [run[c.name][k] for c in mechanism.coordinates]
            u = [run[x.name][k] for x in mechanism.speeds]
            state = state_of(mechanism, float, float(run.t[k]), q, u, list(begin.parameters))
            p = rates_by_lagrange(mechanism, state)[0]
            found.append(value(*q, *p, *begin.parameters))
        assert np.ptp(found) <= 1e-10 * max(1.0, *map(abs, found)), integral.name


# --- as users meet them ----------------------------------------------------------------------------------------------


def test_command_writes_all_formats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(EXAMPLES / "spherical_pendulum.yaml")
    for method in ("hamilton", "routh"):
        for form in ("text", "latex", "html"):
            assert main(["derive", file, "--method", method, "--format", form, "--steps"]) == 0
            out = capsys.readouterr().out
            assert "p_phi" in out or r"p_{\phi}" in out or "<msub>" in out
        assert main(["derive", file, "--method", method, "--json"]) == 0
        data = json.loads(capsys.readouterr().out)
        assert data["method"] == method
        assert data["first_integrals"][0]["name"] == "total_energy()"
    assert data["effective_potential"] == "p_phi^2/2/(m*l^2*sin(theta)^2) - g*l*m*cos(theta)"


def test_equations_are_pickled_and_shown() -> None:
    equations = canonical(pendulum())
    again = pickle.loads(pickle.dumps(equations))
    assert str(again) == str(equations)
    assert r"\dot{p}_{\theta}" in equations._repr_latex_()
    rates = pickle.loads(pickle.dumps(equations.lambdify()))([0.3], [0.2])
    assert rates[0] == pytest.approx([0.2])


def test_all_names_of_a_long_form_are_explained() -> None:
    equations = canonical(chain([f"m{k}" for k in range(5)], [f"l{k}" for k in range(5)]))
    s = equations.symbols
    leaves = {s.time, *s.coordinates, *s.speeds, *s.parameters, *s.inputs, *equations.momenta, *equations.numbers}
    known = {*leaves, *(name for name, _ in equations.definitions)}
    rates = [x for part in equations.rates for x in part]
    parts = [equations.kinetic_energy, equations.potential_energy, equations.function, *rates]
    assert all(e.free_symbols <= known for e in (*parts, *(e for _, e in equations.definitions)))
