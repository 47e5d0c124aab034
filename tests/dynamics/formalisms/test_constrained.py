"""The constrained solve: the same over floats and as statements of a Program, and written in one place."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from numpy.testing import assert_allclose
from package_trees import nodes

from multibody_sym.dynamics.formalisms.constrained import correction, in_floats, solve_constrained
from multibody_sym.program.program import interpret
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import factorize


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return M, f, H (of three rows, the last a sum of the others) and gamma that no row contradicts."""
    rng = np.random.default_rng(seed)  # one seed a case; they have no other meaning
    G = rng.normal(size=(5, 5)) + 3 * np.eye(5)
    H = rng.normal(size=(2, 5))
    H = np.vstack([H, H[0] - 2 * H[1]])
    return G.T @ G, rng.normal(size=5), H, H @ rng.normal(size=5)


@pytest.mark.parametrize("minimum_norm", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_floats_and_statements_find_what_the_whole_matrix_does(seed: int, *, minimum_norm: bool) -> None:
    M, f, H, gamma = drawn(seed)
    numbers = solve_constrained(
        factorize(M.tolist()), f.tolist(), H.tolist(), gamma.tolist(), in_floats, minimum_norm=minimum_norm
    )
    whole = np.block([[M, -H[:2].T], [H[:2], np.zeros((2, 2))]])
    wanted = np.linalg.solve(whole, [*f, *gamma[:2]])
    assert_allclose(numbers.udot, wanted[:5], rtol=1e-10)
    assert_allclose(H.T @ np.array(numbers.multipliers), H[:2].T @ wanted[5:], rtol=1e-9, atol=1e-12)
    trace = Trace("solve", [Array("f", (5,)), Array("gamma", (3,))])
    nodes = solve_constrained(
        factorize([[as_node(x) for x in row] for row in M.tolist()]),
        trace["f"],
        [[as_node(x) for x in row] for row in H.tolist()],
        trace["gamma"],
        trace.solve,
        minimum_norm=minimum_norm,
    )
    program = trace.finish({"udot": ((5,), nodes.udot), "multipliers": ((3,), nodes.multipliers)})
    udot, multipliers = interpret(program, f, gamma)
    assert_allclose(udot, numbers.udot, rtol=1e-12)
    assert_allclose(multipliers, numbers.multipliers, rtol=1e-10)


def test_a_correction_is_the_smallest_in_the_norm_of_the_mass_matrix() -> None:
    M, _, H, gamma = drawn(7)
    change = correction(factorize(M.tolist()), H.tolist(), lambda A: in_floats(A, gamma.tolist(), 5).solution.tolist())
    found = np.array(change)
    assert_allclose(H @ found, gamma, rtol=1e-10)
    inverse = np.linalg.inv(M)
    smallest = inverse @ H[:2].T @ np.linalg.solve(H[:2] @ inverse @ H[:2].T, gamma[:2])
    assert_allclose(found, smallest, rtol=1e-10)


def solving(within: Sequence[ast.AST]) -> Iterator[int]:
    """Yield the lines that turn solutions back from the coordinates in which M is the unit matrix.

    Only the constrained solve has a reason to, that of rows that act as a mode says, and factors made of factors.
    """
    methods = [f for f in within if isinstance(f, ast.FunctionDef) and f.name == "unweighted"]
    own = {id(n) for method in methods for n in ast.walk(method)}
    for node in within:
        if isinstance(node, ast.Attribute) and node.attr == "unweighted" and id(node) not in own:
            yield node.lineno


def test_the_system_with_rows_is_solved_in_one_place() -> None:
    found = {name for name, within in nodes().items() for _ in solving(within)}
    posing = {"dynamics/contact/contact_problem.py", "dynamics/programs/law_programs.py"}  # in these units, too
    assert found == {"dynamics/formalisms/constrained.py", "dynamics/programs/every_mode.py", *posing}
