"""Closed forms as a user meets them: what is printed, shown, evaluated, and said when there is too much of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy
from mechanisms import random_case, random_state
from random_loops import blocks
from textbook import (
    DOWN,
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

from multibody_sym.algebra.quotients import Budget
from multibody_sym.derivation.derive import METHODS, derive
from multibody_sym.derivation.notation import READABLE
from multibody_sym.derivation.symbolic_equations import SymbolicEquations
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.errors import InputError, ModelError, NoSolutionError
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Expression
from multibody_sym.model.joints import Prismatic, Revolute
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System

READABLE_SYSTEMS = [
    pendulum, cart_pole, elastic_pendulum, double_pendulum, spherical_pendulum, top, hanging_mass, pendulum_in_xy,
]


def long_chain(links: int) -> System:
    return chain([f"m{k}" for k in range(links)], [f"l{k}" for k in range(links)])


# --- what is printed -----------------------------------------------------------------------------------------------

GOLDEN = {
    pendulum: "m*l^2*theta'' + m*g*l*sin(theta) = 0",
    cart_pole: (
        "(M + m)*x'' + m*l*theta''*cos(theta) - m*l*theta'^2*sin(theta) = F\n"
        "m*l*x''*cos(theta) + m*l^2*theta'' + m*g*l*sin(theta) = 0"
    ),
    elastic_pendulum: (
        "m*r^2*theta'' + 2*m*r*theta'*r' + m*g*r*sin(theta) = 0\n"
        "m*r'' - m*r*theta'^2 + k*(r - r0) - m*g*cos(theta) = -c*r'"
    ),
    double_pendulum: (
        "((m1 + m2)*l1^2 + m2*l2^2 + 2*m2*l1*l2*cos(q2))*q1'' + (m2*l2^2 + m2*l1*l2*cos(q2))*q2''"
        " - m2*l1*l2*q2'*(2*q1' + q2')*sin(q2) + (m1 + m2)*g*l1*sin(q1) + m2*g*l2*sin(q1 + q2) = 0\n"
        "(m2*l2^2 + m2*l1*l2*cos(q2))*q1'' + m2*l2^2*q2'' + m2*l1*l2*q1'^2*sin(q2) + m2*g*l2*sin(q1 + q2) = 0"
    ),
    spherical_pendulum: (
        "m*l^2*phi''*sin(theta)^2 + 2*m*l^2*phi'*theta'*sin(theta)*cos(theta) = 0\n"
        "m*l^2*theta'' - m*l^2*phi'^2*sin(theta)*cos(theta) + m*g*l*sin(theta) = 0"
    ),
    hanging_mass: "m*y'' + m*g = lambda_rod",
}


@pytest.mark.parametrize("system", GOLDEN, ids=lambda system: system.__name__)
def test_equations_are_printed_as_in_a_book(system: Callable[[], System]) -> None:
    assert str(derive(system())) == GOLDEN[system]


def test_equations_show_themselves_in_a_notebook() -> None:
    shown = derive(pendulum())._repr_latex_()
    assert shown == (
        r"$\displaystyle \begin{aligned}m l^{2} \ddot{\theta} + m g l \sin \theta &= 0\end{aligned}$"
    )


@pytest.mark.parametrize("system", READABLE_SYSTEMS, ids=lambda system: system.__name__)
@pytest.mark.parametrize("method", ["multipliers", "composite_body"])
def test_nothing_is_left_to_simplify(system: Callable[[], System], method: str) -> None:
    """No sin^2 + cos^2, no product of angles that is one of a sum, no |q|^2; sympy finds nothing much shorter."""
    equations = derive(system(), method)
    assert not equations.definitions
    for e in (*equations.mass_matrix, *equations.forcing, equations.kinetic_energy, equations.potential_energy):
        assert e.atoms(sympy.Dummy, sympy.Float, sympy.Derivative) == set()
        shorter = sympy.simplify(e)
        assert e.count_ops() <= shorter.count_ops() + 8, f"{e} is {shorter}"
        assert len(sympy.Add.make_args(sympy.expand(e))) <= len(sympy.Add.make_args(sympy.expand(sympy.fu(e)))) + 1


def test_labels_of_parameters_are_the_books_letters_where_formulas_are_typeset() -> None:
    """The label of a joint is the letter of the joint in pictures: its coordinate keeps its own name."""
    system = System(
        "labels",
        gravity=DOWN,
        parameters={**positive("l"), "mass": Parameter(value=1, label="m_A")},
        bodies={"bob": Body(mass="mass", com=[0, "-l", 0])},
        joints={"hinge": Revolute("ground", "bob", q="angle", label="A")},
    )
    equations = derive(system)
    assert str(equations) == "mass*l^2*angle'' + mass*g*l*sin(angle) = 0"
    assert r"m_{A} l^{2} \ddot{\mathrm{angle}}" in equations._repr_latex_()


# --- the methods ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("system", [cart_pole, top, pendulum_in_xy], ids=lambda system: system.__name__)
def test_methods_give_the_same_matrices(system: Callable[[], System]) -> None:
    first, other = (derive(system(), method) for method in ("multipliers", "composite_body"))
    unit = {}
    if system is top:
        w, x, y, z = first.symbols.coordinates
        unit = {w: sympy.sqrt(1 - x**2 - y**2 - z**2)}
    for name in ("mass_matrix", "forcing", "constraint_jacobian", "constraint_forcing"):
        a, b = getattr(first, name), getattr(other, name)
        assert (a - b).applyfunc(lambda e: sympy.simplify(e.subs(unit))) == sympy.zeros(*a.shape)


def test_the_method_follows_from_the_model() -> None:
    assert derive(pendulum()).method == "lagrange"
    assert derive(hanging_mass()).method == "multipliers"
    with pytest.raises(ModelError, match="choose multipliers"):
        derive(hanging_mass(), "lagrange")
    with pytest.raises(InputError, match=f"choose {', '.join(METHODS)}"):
        derive(pendulum(), "block_ldl")


def test_steps_lead_from_coordinates_to_matrices() -> None:
    steps = derive(pendulum()).steps
    assert [step.title for step in steps] == [
        "Coordinates", "Positions and velocities", "Kinetic energy", "Potential energy", "Generalised forces",
        "Momenta", "Their rates", "Gradient of T", "Gradient of V", "Equations of motion", "Matrix form",
    ]
    assert "Constraints" in [step.title for step in derive(hanging_mass()).steps]


# --- names ---------------------------------------------------------------------------------------------------------


def test_any_name_may_be_a_parameter() -> None:
    """sympy's own letters are ordinary names; so are those of the derivation, and words of Python."""
    words = "E I S N beta gamma lambda z1 Q O zeta lambda_rod pi_ class"
    system = System(
        "names",
        gravity=[0, "-E", 0],
        parameters={name: Parameter(value=1 + 0.1 * k) for k, name in enumerate(words.split())},
        bodies={"bob": Body(mass="S + N + beta + class", com=[0, "-I*Q*O", 0], inertia={"Izz": "gamma*lambda*zeta"})},
        joints={"hinge": Revolute("ground", "bob", axis="z", q="z2")},
    )
    equations = derive(system)
    text = str(equations)
    assert "z2''" in text
    assert "E*" in text
    resolved = mechanism(system)
    values = [1 + 0.1 * k for k in range(len(words.split()))]
    expected = composite_body(resolved, state_of(resolved, float, 0.0, [0.4], [0.2], values))
    assert equations.lambdify()([0.4], [0.2], 0.0, values) == pytest.approx(
        forward_dynamics(expected).udot, rel=1e-12
    )


def test_names_of_sub_expressions_avoid_those_of_the_model() -> None:
    system = chain(["z1", "z2", "z3", "z4", "z5", "z6"], ["z_1", "l2", "l3", "l4", "l5", "l6"])
    equations = derive(system)
    assert equations.definitions
    names = {name.name for name, _ in equations.definitions}
    assert not names & {p.name for p in equations.symbols.parameters}


def test_parameters_are_positive_where_the_model_says_so() -> None:
    equations = derive(
        System("signs", parameters={"m": Parameter(value=1, positive=True), "k": 2},
               bodies={"b": Body(mass="m", com=["k", 0, 0])}, joints={"j": Revolute("ground", "b")})
    )
    m, k = equations.symbols.parameters
    assert m.is_positive
    assert k.is_real
    assert k.is_positive is None


# --- numbers -------------------------------------------------------------------------------------------------------


def assert_evaluates(
    equations: SymbolicEquations, q: list[float], u: list[float], t: float, values: list[float]
) -> None:
    """Compare the NumPy function with composite bodies over floats."""
    resolved = equations.mechanism
    expected = composite_body(resolved, state_of(resolved, float, t, q, u, values))
    found = equations.lambdify()(q, u, t, values)
    wanted = forward_dynamics(expected).udot
    assert found == pytest.approx(wanted, rel=1e-8, abs=1e-8 * np.abs(wanted).max())
    M, f, H, gamma = equations.lambdify("terms")(q, u, t, values)
    assert pytest.approx(np.array(expected.mass_matrix, dtype=float), rel=1e-9, abs=1e-12) == M
    assert f == pytest.approx(np.array(expected.forcing, dtype=float), rel=1e-8, abs=1e-9)
    assert pytest.approx(np.array(expected.constraint_jacobian, dtype=float).reshape(H.shape), rel=1e-9, abs=1e-12) == H
    assert gamma == pytest.approx(np.array(expected.constraint_forcing, dtype=float), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("block", blocks(2, quick=1))
def test_lambdify_agrees_with_composite_bodies(block: int, rows: bool) -> None:
    for seed in range(4000 + 3 * block, 4003 + 3 * block):
        case = random_case(seed, bodies=(1, 3), rows=rows)
        equations = derive(case.mechanism)
        t, q, u = random_state(np.random.default_rng(seed), case)
        assert_evaluates(equations, q, u, t, case.parameters)


def test_lambdify_takes_declared_values_by_default() -> None:
    assert derive(pendulum()).lambdify()([0.5], [0.0]) == pytest.approx([-9.81 * np.sin(0.5)])


def test_lambdify_where_a_row_holds_a_massless_slider() -> None:
    """M is singular, the equations are not: the bob falls freely and takes the slider along."""
    system = System(
        "massless",
        gravity=DOWN,
        parameters=positive("m"),
        bodies={"slider": Body(), "bob": Body(mass="m")},
        joints={
            "a": Prismatic("ground", "slider", axis="x", q="s"),
            "b": Prismatic("ground", "bob", axis="y", q="y"),
        },
        constraints={"along": Expression("s + y")},
    )
    assert derive(system).lambdify()([0.8, -0.8], [0.1, -0.1]) == pytest.approx([9.81, -9.81])


def test_named_and_written_out_forms_have_the_same_value() -> None:
    """A chain just too long to be written out: every name, put in, gives what the numbers give."""
    equations = derive(long_chain(6))
    assert equations.definitions
    q, u = list(np.linspace(-1, 1, 6)), list(np.linspace(2, -1, 6))
    assert_evaluates(equations, q, u, 0.0, [1.0] * 12 + [9.81])
    s = equations.symbols
    at = dict(zip((*s.coordinates, *s.speeds, *s.parameters), [*q, *u, *[1.0] * 12, 9.81], strict=True))
    whole = equations.explicit(equations.mass_matrix[0, 0])
    assert not whole.free_symbols & {name for name, _ in equations.definitions}
    M, *_ = equations.lambdify("terms")(q, u, 0.0, [1.0] * 12 + [9.81])
    assert float(whole.subs(at)) == pytest.approx(M[0, 0], rel=1e-12)


# --- size ----------------------------------------------------------------------------------------------------------


def test_long_equations_are_not_shown_in_a_notebook() -> None:
    equations = derive(long_chain(11))
    assert equations.operations > READABLE
    assert f"{equations.operations} operations in {len(equations.definitions)} named" in equations._repr_latex_()


def test_past_the_budget_comes_advice() -> None:
    with pytest.raises(NoSolutionError, match=r"stopped at the mass matrix.*choose a recursive formalism"):
        derive(long_chain(12), budget=Budget(operations=1500))


def test_unknown_methods_are_told_apart_from_those_without_closed_form() -> None:
    with pytest.raises(InputError, match="there is no method 'foo': choose lagrange, "):
        derive(pendulum(), "foo")
    with pytest.raises(InputError, match="'sweep' gives no closed form: choose lagrange, "):
        derive(pendulum(), "sweep")
