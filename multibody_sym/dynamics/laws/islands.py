"""Islands of a problem of laws: rows that share no weighted coordinate and no law with the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.laws.problem import Friction, FrictionLaw, Law, LawProblem


def islands(problem: LawProblem) -> list[LawProblem]:
    """Return the problems of the islands, whose states make those of the whole, whatever the others do."""
    from scipy.sparse.csgraph import connected_components  # takes long to import

    count = len(problem.right)
    acts = (problem.matrix != 0.0) | (problem.exerted != 0.0)
    joined = acts @ acts.T | (problem.coupling != 0.0)
    for part in problem.parts:
        joined[part.rows[0], [*part.rows, *part.normals]] = True
    number, of = connected_components(joined, directed=False) if count else (0, np.zeros(0))
    return [_alone(problem, np.flatnonzero(of == k).tolist()) for k in range(number)]


def _alone(problem: LawProblem, rows: Sequence[int]) -> LawProblem:
    """Return the problem of some of the rows."""
    places = {row: k for k, row in enumerate(rows)}
    kept = [k for k, part in enumerate(problem.parts) if part.rows[0] in places]
    numbers = {k: number for number, k in enumerate(kept)}
    return LawProblem(
        problem.matrix[rows],
        problem.exerted[rows],
        problem.coupling[np.ix_(rows, rows)],
        problem.right[rows],
        tuple(_numbered(problem.laws[row], numbers) for row in rows),
        tuple(_placed(problem.parts[k], places) for k in kept),
    )


def _numbered(law: Law, numbers: Mapping[int, int]) -> Law:
    return replace(law, part=numbers[law.part]) if isinstance(law, Friction) else law


def _placed(part: FrictionLaw, places: Mapping[int, int]) -> FrictionLaw:
    rows, normals = (tuple(places[k] for k in of) for of in (part.rows, part.normals))
    return replace(part, rows=rows, normals=normals)
