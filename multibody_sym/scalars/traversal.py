"""Ways through expressions: each part once however often it is shared, and without recursion however deep it is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from multibody_sym.scalars.interning import E


def postorder(roots: Iterable[E]) -> Iterator[E]:
    """Yield every expression below `roots` once, operands before the expressions that use them (no recursion)."""
    seen: set[E] = set()
    stack: list[tuple[E, bool]] = []
    for root in roots:
        if not root.args:
            if root not in seen:
                seen.add(root)
                yield root
            continue
        stack.append((root, False))
        while stack:
            node, ready = stack.pop()
            if ready:
                yield node
            elif node not in seen:
                seen.add(node)
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args) if a not in seen)


def leaves(roots: Iterable[E], *ops: str) -> list[E]:
    """Return the leaves below `roots` whose op is one of `ops`, in the order in which they are met."""
    return [node for node in postorder(roots) if node.op in ops]


def flatten(op: str, node: E) -> list[E]:
    """Return the operands of a nested `op`, left to right, as one list."""
    operands, stack = [], [node]
    while stack:
        top = stack.pop()
        if top.op == op:
            stack.extend(reversed(top.args))
        else:
            operands.append(top)
    return operands
