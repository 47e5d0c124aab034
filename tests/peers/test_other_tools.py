"""Functions in CasADi and in JAX: their values and their derivatives of ours, against ours."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from rolling_and_loops import FOUR_BAR

import multibody_sym as mbs

casadi = pytest.importorskip("casadi", reason="the peer casadi (extra: peers) is not installed")
jax = pytest.importorskip("jax", reason="the peer jax (extra: peers) is not installed")

ARM = """
multibody_sym: 1
name: arm
gravity: [0, -9.81, 0]
parameters: {m: 0.7, k: 30, s: k/3}
bodies:
  ground: {points: {hook: [1, 0.4, 0]}}
  cart: {mass: 2}
  upper: {mass: m, com: [0, -0.25, 0], inertia: {Izz: 0.02}, points: {end: [0, -0.5, 0]}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: upper, q: a}
forces:
  spring: {type: spring_damper, between: [ground.hook, upper.end], stiffness: k, damping: s/10, length: 0.2}
  drive: {type: force, on: cart, value: ["push + curve + bend - abs(u_x)*u_x", 0, 0]}
inputs:
  push: -2*x - u_x
  curve: {table: [[-1, 1], [-0.2, 0.3], [0.4, -1], [1, 2]], of: x, interpolation: cubic}
  bend: {table: [[-0.5, 1], [0.1, 0.3], [0.6, -1]], of: a}
"""  # a cart with a link, a spring, inputs that follow the state, two of them by tables
NEAR = 1e-12
MODELS = {"arm": ARM, "four_bar": FOUR_BAR}


@pytest.fixture
def bits() -> Iterator[None]:
    """Let JAX have 64 bits in a test."""
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", False)


@lru_cache
def asked(model: str, what: str) -> mbs.Function[Any]:
    return mbs.function(mbs.loads(MODELS[model]), what, backend="python")


def state(f: mbs.Function[Any], seed: int = 0) -> list[Any]:
    rng, mechanism = np.random.default_rng(seed), mbs.mechanism(f.system)
    q = rng.uniform(-0.9, 0.9, len(mechanism.coordinates))
    return [0.3, q, *(rng.standard_normal(len(mechanism.speeds)) for _ in f.arguments[2:])]


def near(found: Any, wanted: np.ndarray) -> None:
    off = np.array(found, dtype=float).reshape(wanted.shape) - wanted
    assert np.abs(off).max(initial=0.0) <= NEAR * np.abs(wanted).max(initial=1.0)


@pytest.mark.parametrize("model", MODELS)
def test_casadi_functions_and_their_jacobians_are_ours(model: str) -> None:
    f = asked(model, "state_derivative")
    found = f.to_casadi()
    assert (found.name_in(), found.name_out()) == (list(f.arguments), list(f.names))
    assert [found.size_out(k) for k in range(3)] == [(*shape, 1)[:2] for shape in f.shapes.values()]
    given = state(f)
    for theirs, ours in zip(found.call([casadi.DM(x) for x in given]), f(*given), strict=True):
        near(theirs, ours)
    q, u = (casadi.SX.sym(name, len(x)) for name, x in zip("qu", given[1:], strict=True))
    udot = found(given[0], q, u)[1]
    jacobians = casadi.Function("jacobians", [q, u], [casadi.jacobian(udot, q), casadi.jacobian(udot, u)])
    for theirs, by in zip(jacobians(*given[1:]), ("q", "u"), strict=True):
        near(theirs, f.derivative(by)(*given).udot)


def test_free_inputs_and_parameters_are_arguments_of_casadi() -> None:
    f = asked("arm", "state_derivative")
    found = f.to_casadi(inputs="free", parameters="free")
    assert found.name_in() == ["t", "q", "u", "inputs", "parameters"]
    given, own, values = state(f), np.array([1.5, -0.5, 0.2]), f.parameter_values * [2.0, 1.0, 1.0]
    near(found(*given, own, values)[1], f(*given, inputs=own, parameters=values).udot)
    mass = asked("arm", "mass_matrix")
    near(mass.to_casadi()(*given), mass(*given))
    assert mass.to_casadi().sparsity_out(0).nnz() == 4


def test_casadi_has_no_results_of_three_axes() -> None:
    with pytest.raises(mbs.InputError, match=r"mass_matrix has the shape \(2, 2, 2\).*jacobian"):
        asked("arm", "mass_matrix").derivative("q").to_casadi()
    with pytest.raises(mbs.InputError, match="inputs is \"free\" or left out"):
        asked("arm", "mass_matrix").to_casadi(inputs="all")  # type: ignore[arg-type]


def test_dependent_constraints_are_an_error() -> None:
    text = f"{FOUR_BAR}  again: {{type: revolute, parent: coupler.end, child: rocker.end}}\n"
    with pytest.raises(mbs.ModelError, match="constraints depend on each other"):
        mbs.function(mbs.loads(text), "state_derivative", backend="python").to_casadi()


def test_jax_compiles_maps_and_differentiates(bits: None) -> None:
    f = asked("arm", "state_derivative")
    g = f.to_jax()
    potential = asked("arm", "energies").to_jax()
    t, q, u = state(f)
    many = np.stack([q, q + 0.1, q - 0.1])

    @jax.jit
    def every(q: Any, many: Any) -> tuple[Any, ...]:
        slope = jax.grad(lambda q: potential(t, q, u).potential)(q)
        return jax.vmap(g, (None, 0, None))(t, many, u), jax.jacfwd(g, 1)(t, q, u).udot, slope

    mapped, rates, slope = every(q, many)
    assert type(mapped) is type(f(t, q, u))
    for theirs, ours in zip(mapped, f(t, many, u), strict=True):
        near(theirs, ours)
    near(rates, f.derivative("q")(t, q, u).udot)
    near(slope, asked("arm", "energies").derivative("q")(t, q, u).potential)
    with pytest.raises(mbs.InputError, match=r"q has the shape \(3, 2\), not \(2,\): jax.vmap"):
        g(t, many, u)
    with pytest.raises(mbs.InputError, match=r"takes 3 arguments \(t, q, u\), not 2"):
        g(t, q)


def test_jax_needs_64_bits_and_its_switch_stays_as_it_is(bits: None) -> None:
    f = asked("arm", "energies")
    g = f.to_jax()
    jax.config.update("jax_enable_x64", False)
    for call in (f.to_jax, lambda: g(*state(f))):
        with pytest.raises(mbs.InputError, match="jax_enable_x64"):
            call()
    assert not jax.config.jax_enable_x64
