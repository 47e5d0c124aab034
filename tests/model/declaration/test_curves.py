"""Tables as inputs, against scipy's interpolation; how they are declared; runs that follow them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from multibody_sym.errors import InputError
from multibody_sym.formats.reader import loads
from multibody_sym.formats.writer import dumps
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.forces import Torque
from multibody_sym.model.declaration.joints import Revolute
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.tables import MOST_ROWS, Table, bends, interpolated
from multibody_sym.model.resolution.resolve import mechanism
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.traversal import postorder
from multibody_sym.simulation.simulate import simulate

T = symbol("t")


def rows(count: int) -> np.ndarray:
    rng = np.random.default_rng(count)
    return np.column_stack([np.cumsum(rng.uniform(0.1, 1.0, count)) - 1, rng.normal(size=count)])


def values(node: Any, times: np.ndarray) -> np.ndarray:
    return np.array([evaluate_float([node], {T: float(t)})[0] for t in times])


@pytest.mark.parametrize("count", [2, 3, 4, 17])
def test_linear_is_numpys(count: int) -> None:
    table = rows(count)
    times = np.concatenate([np.linspace(-3, table[-1, 0] + 2, 101), table[:, 0]])
    found = values(interpolated(Table(table)), times)
    np.testing.assert_allclose(found, np.interp(times, *table.T), rtol=0, atol=1e-13)


@pytest.mark.parametrize("count", [2, 3, 4, 17])
def test_cubic_is_the_natural_spline(count: int) -> None:
    table = rows(count)
    times = np.concatenate([np.linspace(-3, table[-1, 0] + 2, 101), table[:, 0]])
    node = interpolated(Table(table, interpolation="cubic"))
    spline = CubicSpline(*table.T, bc_type="natural")
    np.testing.assert_allclose(values(node, times), spline(np.clip(times, *table[[0, -1], 0])), rtol=0, atol=1e-12)
    inside = times[(times > table[0, 0]) & (times < table[-1, 0])]
    np.testing.assert_allclose(values(derivative(node, T), inside), spline(inside, 1), rtol=0, atol=1e-11)


def test_a_thousand_rows_are_found_in_ten_comparisons() -> None:
    node = interpolated(Table([[k, k % 7] for k in range(MOST_ROWS)]))
    depth: dict[Any, int] = {}
    for n in postorder([node]):
        depth[n] = max((depth[a] for a in n.args), default=0) + (n.op == "where")
    assert depth[node] == 10
    assert evaluate_float([node], {T: 998.5})[0] == pytest.approx((998 % 7 + 999 % 7) / 2)


def test_linear_tables_bend_at_every_row_and_splines_at_their_ends() -> None:
    table = rows(5)
    for bend, argument in zip(bends(Table(table)), table[:, 0], strict=True):
        assert evaluate_float([bend], {T: float(argument)}) == [0.0]
    assert len(bends(Table(table, interpolation="cubic"))) == 2


TEXT = """\
multibody_sym: 1
name: s
bodies: {a: {mass: 1, inertia: {Izz: 2}}}
joints: {A: {type: revolute, parent: ground, child: a}}
forces: {drive: {type: torque, joint: A, value: tau}, spring: {type: torque, joint: A, value: law}}
inputs:
  tau: {table: [[0 s, 0], [1, 2 N*m], [2, 0]]}
  law: {table: [[-1, 1], [0, 0], [1, -3]], of: 2*A, interpolation: cubic}
"""


def test_tables_are_read_and_written() -> None:
    system = loads(TEXT)
    assert loads(dumps(system)) == system
    inputs = {
        "tau": Table([[0, 0], [1, "2 N*m"], [2, 0]]),
        "law": Table([[-1, 1], [0, 0], [1, -3]], of="2*A", interpolation="cubic"),
    }
    forces = {"drive": Torque("tau", joint="A"), "spring": Torque("law", joint="A")}
    bodies, joints = {"a": Body(mass=1, inertia={"Izz": 2})}, {"A": Revolute("ground", "a")}
    assert System("s", bodies=bodies, joints=joints, forces=forces, inputs=inputs) == system


@pytest.mark.parametrize("backend", ["c", "python"])
def test_run_follows_a_table(backend: str) -> None:
    """A triangle of torque turns the body: the speed is its integral, held steps of the integrator included."""
    text = TEXT.replace("value: law", "value: 0*law")
    run = simulate(loads(text), t_end=3, samples=7, backend=backend)
    speed = [0, 0.125, 0.5, 0.875, 1, 1, 1]
    np.testing.assert_allclose(run["u_A"], speed, atol=1e-12)
    np.testing.assert_allclose(run["tau"], [0, 1, 2, 1, 0, 0, 0], atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "message", "path"),
    [
        ("[1, 2 N*m]", "[0, 2]", "row 2 begins with 0, which does not come after 0", ("inputs", "tau", "table", "1")),
        ("[1, 2 N*m]", "[1, m]", "a table holds numbers, got m", ("inputs", "tau", "table", "1")),
        ("[1, 2 N*m]", "[1, 2, 3]", r"expected a row \[argument, value\], got a list", ("inputs", "tau", "table", "1")),
        ("[[0 s, 0], [1, 2 N*m], [2, 0]]", "[[0, 1]]", "2 to 1,000 rows, got 1", ("inputs", "tau", "table")),
        ("cubic", "quintic", "'quintic' is no choice here", ("inputs", "law", "interpolation")),
        ("of: 2*A", "of: 2*B", "'B' is not declared", ("inputs", "law", "of")),
        ("of: 2*A", "at: 2*A", "unknown key 'at'", ("inputs", "law", "at")),
    ],
)
def test_wrong_tables_are_named(old: str, new: str, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=message) as caught:
        mechanism(loads(TEXT.replace(old, new)))
    assert caught.value.where.path == path


def test_too_many_rows_are_refused() -> None:
    with pytest.raises(InputError, match="got 1001"):
        Table([[k, 0] for k in range(MOST_ROWS + 1)])
