"""Random passes over random trees, scanned or unrolled: down with what the parent has, up with what children add.

At the end every body behind an open gate keeps a copy of its own data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array, Kernel, Loop, Window, progression
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import ZERO, Node

WIDTH = 2
"""Elements of a body's own data, of its row and of what it adds to its parent's."""
Make = Callable[[str, Sequence[Array], dict[str, tuple[int, ...]]], Program]
"""Makes a Program with a name, inputs and the shapes of outputs."""


@dataclass(frozen=True)
class Passes:
    """`parents[k] < k` (-1: root), `kinds[k]` of each body, whose gate is open, and Programs of a kind both ways.

    Down: (own, shared, parent's row) -> (row, share of a sum); up: (own, row, sum of children) -> what the parent gets.
    """

    parents: tuple[int, ...]
    kinds: tuple[int, ...]
    opens: tuple[bool, ...]
    down: tuple[Program, ...]
    up: tuple[Program, ...]

    @staticmethod
    def random(random, make: Make, count: int, *, chain: bool = False) -> Passes:
        """Return passes over `count` bodies of two kinds."""
        parents = tuple(k - 1 if chain else random.randrange(-1, k) for k in range(count))
        kinds = tuple(k % 2 if chain else random.randrange(2) for k in range(count))
        opens = tuple(random.random() < 0.5 for _ in range(count))
        own, row = Array("own", (WIDTH,)), Array("row", (WIDTH,))
        rows = {"row": (WIDTH,), "share": ()}
        down = [make(f"down_{k}", [own, Array("shared"), row], rows) for k in range(2)]
        up = [make(f"up_{k}", [own, row, Array("sum", (WIDTH,))], {"sum": (WIDTH,)}) for k in range(2)]
        return Passes(parents, kinds, opens, tuple(down), tuple(up))

    def scanned(self, trace: Trace, own: Sequence[Node], shared: Node) -> list[Node]:
        """Return all rows, the sum of shares and what arrives at the root, and copies, by one scan."""
        count = len(self.parents)
        outward, inward, once = range(count), range(count - 1, -1, -1), progression([0])

        def at(array: int, order: range, row: Callable[[int], int], adds: bool = False) -> Window:
            return Window(array, progression([WIDTH * row(k) for k in order]), adds)

        def mine(k: int) -> int:
            return k + 1

        def above(k: int) -> int:
            return self.parents[k] + 1

        given, sums, kept, work = 3, 4, 5, 6
        read = at(0, outward, int), Window(1, once), at(given, outward, above)
        written = at(given, outward, mine), Window(sums, once, adds=True)
        read_up = at(0, inward, int), at(given, inward, mine), at(work, inward, mine)
        first, gate = at(0, outward, int), Window(2, progression(outward))
        loops = [
            Loop(count, tuple(Kernel(p, read, written) for p in self.down), progression(self.kinds)),
            Loop(
                count,
                tuple(Kernel(p, read_up, (at(work, inward, above, adds=True),)) for p in self.up),
                progression([self.kinds[k] for k in inward]),
            ),
            Loop(1, (Kernel(_copy(), (Window(work, once),), (Window(sums, once, adds=True),)),)),
            Loop(count, (Kernel(_copy(), (first,), (Window(kept, progression(outward)),)),), gate=gate),
        ]
        size = WIDTH * (count + 1)
        gates = [1 + own[WIDTH * k] ** 2 if opens else ZERO for k, opens in enumerate(self.opens)]
        found = trace.scan([own, [shared], gates], [size, 1, count], [size], loops)
        return [*found[0], *found[1], *found[2]]

    def unrolled(self, trace: Trace, own: Sequence[Node], shared: Node) -> list[Node]:
        """Return the same by a call for each body."""
        rows: list[Sequence[Node]] = [[ZERO] * WIDTH]
        sums: list[list[Node]] = [[ZERO] * WIDTH for _ in range(len(self.parents) + 1)]
        total: Node = ZERO
        datas = [own[WIDTH * k : WIDTH * (k + 1)] for k in range(len(self.parents))]
        for kind, parent, data in zip(self.kinds, self.parents, datas, strict=True):
            row, share = trace.call(self.down[kind], [data, [shared], rows[parent + 1]])
            rows.append(row)
            total = total + share[0]
        for k in range(len(self.parents) - 1, -1, -1):
            (given,) = trace.call(self.up[self.kinds[k]], [datas[k], rows[k + 1], sums[k + 1]])
            parent = self.parents[k] + 1
            sums[parent] = [a + b for a, b in zip(sums[parent], given, strict=True)]
        copies = [data[0] if opens else ZERO for data, opens in zip(datas, self.opens, strict=True)]
        return [*(x for row in rows for x in row), total + sums[0][0], *copies]


def _copy() -> Program:
    trace = Trace("copy", [Array("x")])
    return trace.finish({"y": ((), trace["x"])})
