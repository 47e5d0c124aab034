"""The equations of motion over letters, reduced to the freedoms: J a = Q, with what each body turns or moves for them.

J_ij = sum K_ai M_ab K_bj,  Q_i = sum K_ai (f_a - M_ab c_b),  where a = K a_free + c is what the loops leave.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Final

from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.in_letters.coordinates import Coordinates
from multibody_sym.answers.in_letters.letters import Letters
from multibody_sym.answers.in_letters.loops import Loops
from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.inverse_dynamics import inverse_dynamics
from multibody_sym.expressions.printer import text
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import gradient
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node

_SHORT: Final = 12
"""Up to how many letters of text a ratio stands itself in what is reduced."""


@dataclass
class Reduced:
    """The equations at the places of `coordinates.all`; `name` gives free letters, `define` keeps what they are."""

    coordinates: Coordinates
    letters: Letters
    loops: Loops
    name: Callable[[str], Node]
    define: Callable[[Node, Definition], None]

    @cached_property
    def matrix(self) -> list[list[Quotient]]:
        """M between the letters of accelerations."""
        letters, rows = self.letters, mass_matrix(self.coordinates.motion)
        turned, _ = self._changes
        given = [letters.of(row) for row in rows]
        return [[_between(given, a, b, letters) for b in turned] for a in turned]

    @cached_property
    def forcing(self) -> list[Quotient]:
        """F less what inertia takes without the accelerations of letters."""
        motion, letters = self.coordinates.motion, self.letters
        turned, rest = self._changes
        needed = inverse_dynamics(motion, rest)
        forces = applied_generalized_forces(motion, applied(motion))
        left = letters.of(as_node(q) - as_node(c) for q, c in zip(forces, needed, strict=True))
        zero = letters.field.constant(0)
        return [sum((left[k] * n for k, n in column.items()), zero) for column in turned]

    @cached_property
    def _changes(self) -> tuple[list[dict[int, int]], list[Node]]:
        """How much of each letter's acceleration is in which speed's rate, and what is in those without letters."""
        along = [x.letters[2] for x in self.coordinates.all]
        parts = [gradient(node, along) for node in self.coordinates.udot]
        columns = [
            {k: int(row[j].shadow or 0) for k, row in enumerate(parts) if row[j] is not ZERO} for j in range(len(along))
        ]
        at_rest = dict.fromkeys(along, ZERO)
        rest = [as_node(evaluate([x], lambda n: at_rest.get(n, n))[0]) for x in self.coordinates.udot]
        return columns, rest

    def of_freedoms(self) -> dict[int, Quotient]:
        """Return the accelerations at the free places; letters that are needed for them are defined."""
        free, ratios, bias = self.loops.free, self._ratios(), self._bias()
        places, zero = range(len(self.coordinates.all)), self.letters.field.constant(0)
        lacking = [self.forcing[a] - sum((self.matrix[a][b] * x for b, x in bias.items()), zero) for a in places]
        left, right = [], []
        for i in free:
            name = self._free_name(i)
            of = {a: sum((x[i] * self.matrix[a][b] for b, x in enumerate(ratios) if i in x), zero) for a in places}
            sums = {j: sum((x[j] * of[a] for a, x in enumerate(ratios) if j in x), zero) for j in free}
            left.append([self._named(x, self._inertia(i, j), f"inertia that {name} meets") for j, x in sums.items()])
            force = sum((x[i] * lacking[a] for a, x in enumerate(ratios) if i in x), zero)
            right.append(self._named(force, f"Q_{name}", f"what drives {name}: loads, less inertia at steady {name}"))
        return dict(zip(free, exact_solve(left, right), strict=True))

    def _free_name(self, place: int) -> str:
        return self.coordinates.mechanism.coordinates[self.coordinates.all[place].q].name

    def _inertia(self, i: int, j: int) -> str:
        return "_".join(("J", *dict.fromkeys((self._free_name(i), self._free_name(j)))))

    def _ratios(self) -> list[dict[int, Quotient]]:
        """Return how each place moves with each free one, in letters where that is long."""
        one, zero = self.letters.field.constant(1), self.letters.field.constant(0)
        found: list[dict[int, Quotient]] = [{} for _ in self.coordinates.all]
        for i in self.loops.free:
            found[i][i] = one
            of = self._free_name(i)

            def told(k: int, x: Quotient, i: int = i, of: str = of) -> Quotient:
                body = self.coordinates.all[k].body
                wanted = f"k_{body}" if len(self.loops.free) == 1 else f"k_{body}_{of}"
                kept = self._named(x, wanted, f"how fast {body} moves for a unit speed of {of}")
                if not x.is_zero:
                    found[k][i] = kept
                return kept

            self.loops.solved({j: one if j == i else zero for j in self.loops.free}, self.loops.nothing, told)
        return found

    def _bias(self) -> dict[int, Quotient]:
        """Return the accelerations for none at the free places."""
        zero, found = self.letters.field.constant(0), dict[int, Quotient]()

        def told(k: int, x: Quotient) -> Quotient:
            body = self.coordinates.all[k].body
            kept = self._named(x, f"c_{body}", f"acceleration of {body} where what is free moves steadily")
            if not x.is_zero:
                found[k] = kept
            return kept

        self.loops.solved(dict.fromkeys(self.loops.free, zero), self.loops.bias, told)
        return found

    def _named(self, x: Quotient, wanted: str, says: str) -> Quotient:
        """Return a letter for what is long."""
        form = self.letters.written(x)
        if len(text(form)) <= _SHORT:
            return x
        node = self.name(wanted)
        self.letters.add(node, float(x.sample))
        self.define(node, Definition(float(x.sample), form, says=says))
        return self.letters.known[node]


def _between(matrix: list[list[Quotient]], a: Mapping[int, int], b: Mapping[int, int], letters: Letters) -> Quotient:
    total = letters.field.constant(0)
    for k, m in a.items():
        for j, n in b.items():
            total = total + matrix[k][j] * (m * n)
    return total
