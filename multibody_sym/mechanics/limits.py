"""What must hold of the elements of a mechanism so that a mode lasts: which limits there are, of what kind.

    kind     what must not be negative                       beyond it
    force    the normal force of what acts                   it opens
    gap      the distance of what does not act               it closes
    side     a reaction in a joint, towards its side         it presses on the other side
    cone     static N - |F| of what sticks                   it slips
    slip     how fast what slips does so the way it does     it stops

The formulas of their values are those of `scalars.limits`, over any scalar.
"""

from __future__ import annotations

from collections.abc import Iterator

from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement, Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.row_records import RopeRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import Kind
from multibody_sym.scalars.node import ZERO


@dataclass(frozen=True)
class Limit:
    """A limit of an element: of its friction `part`, or of its normal row by number."""

    kind: Kind
    element: LawElement
    part: FrictionPart | None = None
    normal: int = 0


def limits_in(mode: Mode, element: LawElement) -> Iterator[Limit]:
    """Yield the limits of an element in a mode. What touches and carries nothing is limited by its distance alone."""
    if element.unilateral:
        carries = mode.acts(element) and element.name not in mode.idle
        yield Limit("force" if carries else "gap", element)
        if not carries:
            return
    else:
        yield from (Limit("side", element, normal=k) for k in sided_normals(element))
    for part in element.frictions if mode.acts(element) else ():
        if part.regularised is None and part.rubs:
            if mode.slip(part) != STICKS:
                yield Limit("slip", element, part)
            elif part.static is not ZERO and not part.enough and part.name not in mode.carried:
                yield Limit("cone", element, part)


def sided_normals(element: LawElement) -> list[int]:
    """Return which normals of an element whose reactions are of either sign press by their size, each alone."""
    parts = [part for part in element.frictions if part.static is not ZERO and not (part.enough or part.norm)]
    return [k for k in range(len(element.normals)) if any(k in part.normals for part in parts)]


def taut_ropes(mechanism: Mechanism) -> Iterator[tuple[int, RopeRow]]:
    """Yield by number the rows of ropes that hold both ways, as declared: they must not push."""
    own = {row.name for element in mechanism.one_way for row in element.rows}
    for k, row in enumerate(mechanism.rows):
        if isinstance(row, RopeRow) and row.name not in own:
            yield k, row
