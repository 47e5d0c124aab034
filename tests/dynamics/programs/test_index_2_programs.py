"""The Programs of index 2 against those of index 1 and against differences: inputs, rolling, rows that move."""

from pathlib import Path

import numpy as np
import pytest
from test_state_jacobian import HELD

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program import derivatives
from multibody_sym.program.program import interpret

COIN = (Path(__file__).parents[3] / "examples" / "rolling_coin.yaml").read_text()
TEXTS = {"inputs": HELD, "moving": HELD.replace("value: l}", "value: l + 0.1*sin(t)}"), "rolling": COIN}


def made_of(text, formalism="composite_body"):
    """Return the Programs, and what calls one of them at (x, multipliers) with the model's parameters at 0.7 s."""
    system = mechanism(mbs.loads(text))
    made, begin = programs(system, FORMALISMS[formalism], "index_2"), start(system)

    def call(program, x, *further):
        given = (0.7, x[: made.nq], x[made.nq :], np.array(begin.parameters))
        return interpret(program, *given, interpret(made.inputs, *given)[0], np.zeros(0), *further)

    return made, call, np.array([*begin.q, *begin.u])


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("formalism", ["composite_body", "block_ldl"])
def test_with_the_multipliers_of_index_1_they_give_its_accelerations(text, formalism):
    made, call, x = made_of(text, formalism)
    qdot, udot, multipliers, _ = call(made.state_derivative, x)
    found = call(made.index_2, x, np.concatenate([np.zeros_like(multipliers), multipliers]))
    wanted = (qdot, udot, call(made.project_position, x)[0], call(made.project_velocity, x)[0])
    for values, same in zip(found, wanted, strict=True):
        np.testing.assert_allclose(values, same, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("largest", [10_000, 0], ids=["inline", "called"])
def test_the_derivatives_are_limits_of_differences(text, largest, monkeypatch):
    monkeypatch.setattr(derivatives, "_LARGEST_INLINE", largest)
    made, call, x = made_of(text)
    n = len(x)
    y = np.concatenate([x, np.zeros(2 * made.ns)])
    y = y + 0.1 * np.sin(1.0 + np.arange(len(y)))

    def values(y):
        return np.concatenate(call(made.index_2, y[:n], y[n:]))

    found = np.zeros((len(y), len(y)))
    (found[:, :n],) = call(made.index_2_by_state, y[:n], y[n:])
    (found[:n, n:],) = call(made.index_2_by_multipliers, y[:n])
    step = 1e-5
    wanted = [(values(y + step * e) - values(y - step * e)) / (2 * step) for e in np.eye(len(y))]
    np.testing.assert_allclose(found, np.array(wanted).T, atol=1e-7 * np.abs(found).max())


def test_they_are_derived_where_asked_for_only():
    system = mechanism(mbs.loads(HELD))
    assert programs(system, FORMALISMS["block_ldl"], "implicit").index_2 is None
    assert programs(system, FORMALISMS["block_ldl"], "index_2").jacobian is None
