"""Derivations as text, LaTeX and data."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from textbook import chain, hanging_mass, pendulum, top

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.derivation.derive import derive
from multibody_sym.documents.derivation import derivation_data, derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.documents.formulas import ABOVE
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

TEXTBOOK = Path(__file__).parents[2] / "examples" / "textbook"

STEPS = """\
pendulum: Lagrange's equations of the second kind

Coordinates
    hinge: theta

Positions and velocities
    r_bob = [l*sin(theta), -l*cos(theta), 0]
    v_bob = [l*theta'*cos(theta), l*theta'*sin(theta), 0]

Kinetic energy
    T = m*l^2*theta'^2/2

Potential energy
    V = -m*g*l*cos(theta)

Generalised forces
    V holds all loads

Momenta
    dT/dtheta' = m*l^2*theta'

Their rates
    d/dt dT/dtheta' = m*l^2*theta''

Gradient of T
    dT/dtheta = 0

Gradient of V
    dV/dtheta = m*g*l*sin(theta)

Equations of motion
    m*l^2*theta'' + m*g*l*sin(theta) = 0

Matrix form
    M = [m*l^2]
    f = [-m*g*l*sin(theta)]
    M u' = f"""

RESULT = """\
hanging_mass: Lagrange's equations with multipliers

Kinetic energy
    T = m*y'^2/2

Potential energy
    V = m*g*y

Sides at the start, on which these equations hold
    rod, ground to bob: -y > 0

Constraints
    phi_rod = l + y
    d/dt phi_rod = y'
    phi = 0; the multiplier is positive for a pulling rope or rod

Equations of motion
    m*y'' + m*g = lambda_rod"""


def test_steps_as_text() -> None:
    assert write_document(derivation_document(derive(pendulum()), steps=True), "text") == STEPS


def test_result_as_text() -> None:
    assert write_document(derivation_document(derive(hanging_mass())), "text") == RESULT


def test_latex_has_a_paragraph_for_each_step() -> None:
    equations = derive(top())
    latex = write_document(derivation_document(equations, steps=True), "latex")
    assert [f"\\paragraph{{{step.title}}}" in latex for step in equations.steps] == [True] * len(equations.steps)
    assert latex.count(r"\begin{align*}") == latex.count(r"\end{align*}") > 0
    assert r"\frac{d}{dt} \frac{\partial T}{\partial \omega_{z}}" in latex


def test_long_equations_come_with_names_and_advice() -> None:
    equations = derive(chain([f"m{k}" for k in range(11)], [f"l{k}" for k in range(11)]))
    text = write_document(derivation_document(equations), "text")
    assert "\nwhere\n    z1 = " in text
    assert text.endswith("recursive formalism (--formalism composite_body or block_ldl)")
    assert all(f"{name} = " in text for name, _ in equations.definitions)


@pytest.mark.parametrize("links", [2, 6])
def test_data_is_in_the_models_own_language(links: int) -> None:
    """M of the JSON object, read by the parser and evaluated, is that of composite bodies; names included."""
    system = chain([f"m{k}" for k in range(links)], [f"l{k}" for k in range(links)])
    data = json.loads(json.dumps(derivation_data(derive(system))))
    resolved = mechanism(system)
    q, u = list(np.linspace(0.3, 1, links)), list(np.linspace(1, -1, links))
    parameters = [1.0 + 0.1 * k for k in range(2 * links)] + [9.81]
    values = dict(zip(map(symbol, [*data["coordinates"], *data["speeds"]]), [*q, *u], strict=True))
    values.update(zip((symbol(p.name) for p in resolved.parameters), parameters, strict=True))
    for name, text in data["definitions"].items():
        values[symbol(name)] = evaluate_float([parse(text)], values)[0]
    expected = composite_body(resolved, state_of(resolved, float, 0.0, q, u, parameters))
    matrix = [evaluate_float([parse(text) for text in row], values) for row in data["mass_matrix"]]
    assert np.array(matrix) == pytest.approx(np.array(expected.mass_matrix), rel=1e-12)
    forcing = evaluate_float([parse(text) for text in data["forcing"]], values)
    assert forcing == pytest.approx(expected.forcing, rel=1e-10)
    assert not leaves([parse(text) for text in data["forcing"]], "quantity")
    assert [set(e) for e in data["equations"]] == [{"text", "latex"}] * links
    assert set(data["units"]["state"].values()) == {"rad", "rad/s"}


def test_bodies_cut_free_have_the_letters_of_books() -> None:
    found = derive(mbs.load(TEXTBOOK / "t7_atwood.yaml"), method="newton_euler")
    text = write_document(derivation_document(found, steps=True), "text")
    assert "Forces\n    T: tension of string\n\nBody left\n    m1*y1'' = T - m1*g\n" in text
    assert "lambda" not in text.partition("Matrix form")[0]
    assert derivation_data(found)["letters"]["lambda_string"] == "T"
    assert r"m_{1} \ddot{y}_{1} &= T - m_{1} g" in write_document(derivation_document(found, steps=True), "latex")


@pytest.mark.parametrize("method", ["multipliers", "newton_euler"])
def test_derivations_are_whole_documents(method: str) -> None:
    found = derive(mbs.load(TEXTBOOK / "t8_blocks_in_a_row.yaml"), method=method)
    latex = write_document(derivation_document(found, steps=True), "latex")
    assert latex.startswith(r"\documentclass")
    assert latex.endswith("\\end{document}\n")
    assert latex.count("{") == latex.count("}")
    assert latex.count(r"\begin{") == latex.count(r"\end{")
    html = write_document(derivation_document(found, steps=True), "html")
    assert html.startswith("<!DOCTYPE html>")
    assert html.count("<math ") == html.count("</math>")
    assert f'<msub><mover><mi>x</mi><mo {ABOVE}>&#xA8;</mo></mover><mrow><mn>1</mn></mrow></msub>' in html


def test_command_writes_documents(capsys: pytest.CaptureFixture[str]) -> None:
    path = str(TEXTBOOK / "t7_atwood.yaml")
    assert main(["derive", path, "--steps", "--format", "latex"]) == 0
    assert capsys.readouterr().out.startswith(r"\documentclass")
    assert main(["derive", path, "--method", "newton_euler", "--format", "html"]) == 0
    assert "<h2>Body left</h2>" in capsys.readouterr().out
