"""What the numbers of a mode make of contacts by kinds: said once a kind, and scanned over those that act.

A function here takes a kind and its rows, in whose arrays it reads, and returns values by name.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from multibody_sym.dynamics.formalisms.constrained import Sharing
from multibody_sym.dynamics.programs.law_rows import STABILISING, RowValues
from multibody_sym.dynamics.programs.like_contacts import ContactKind
from multibody_sym.dynamics.programs.mode_values import ModeValues, chosen, is_of_normal
from multibody_sym.dynamics.programs.sliding_parts import (
    Friction,
    Row,
    combination,
    times,
    with_friction,
    with_sliding,
)
from multibody_sym.dynamics.programs.system import felt
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.model.mechanism.every_mode import ModeNodes, friction_parts
from multibody_sym.model.mechanism.rows import Row as DeclaredRow
from multibody_sym.scalars.functions import absolute
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node

Named = dict[str, list[Node]]


def pressing(kind: ContactKind, rows: RowValues) -> Named:
    """Return `gamma` and `right` with Baumgarte's terms, and the elements of `exerted` and `carried` (`exerted_by`)."""
    own, (exerted, carried) = kind.leaves, exerted_by(kind, rows)
    given = zip(kind.mechanism.rows, own["phi"], own["phidot"], strict=True)
    terms = [baumgarte(row, phi, phidot, own[STABILISING]) for row, phi, phidot in given]
    return {
        "gamma": [x + dx for x, dx in zip(own["gamma"], terms, strict=True)],
        "right": [x + dx for x, dx in zip(own["right"], terms, strict=True)],
        "exerted": elements(exerted),
        "carried": elements([carried]),
    }


def exerted_by(kind: ContactKind, rows: RowValues) -> tuple[list[Row], Row]:
    """Return by the speeds of a contact the force of each way in which its rows share, friction included.

    And that of all its rows with the shares that a mode gives them.
    """
    sliding = with_sliding(rows.matrix("exerted", kind.leaves), _frictions(kind))
    modes = ModeNodes(kind.mechanism)
    ways = [combination((x, sliding[j]) for j, x in way) for way in modes.ways()]
    return ways, combination(zip(modes.carried(), sliding, strict=True))


def unloaded(kind: ContactKind, rows: RowValues) -> Named:
    """Return `right` less what the motion `near`, that of the shares of all rows, gives to it."""
    return {"right": _less(kind.leaves["right"], rows.matrix("matrix", kind.leaves), kind.leaves["near"])}


def missing(kind: ContactKind, rows: RowValues) -> Named:
    """Return by how much the accelerations `near` are short of `gamma`."""
    return {"missing": _less(kind.leaves["gamma"], rows.matrix("jacobian", kind.leaves), kind.leaves["near"])}


def multipliers(kind: ContactKind, rows: RowValues) -> Named:
    """Return the multipliers of all rows for the sum of both solves, `taken` and `more`, one number a way."""
    own, modes = kind.leaves, ModeNodes(kind.mechanism)
    taken = [x + y for x, y in zip(own["taken"], own["more"], strict=True)]
    found = Sharing(modes.carried(), modes.ways()).carried(taken)
    return {"multipliers": with_friction(list(map(as_node, found)), _frictions(kind))}


def correcting(kind: ContactKind, rows: RowValues) -> Named:
    """Return the `elements` of the rows by which speeds are put back (see `correcting_rows`)."""
    return {"elements": elements(correcting_rows(kind, rows))}


def correcting_rows(kind: ContactKind, rows: RowValues) -> list[Row]:
    """Return rows of the speeds: of all by mass, or of those not held."""
    own = kind.leaves
    jacobian, by_mass = (rows.matrix(name, own) for name in ("jacobian", "matrix"))
    some = ModeNodes(kind.mechanism).any_held
    return [of_moving(*each, own["held"], some) for each in zip(jacobian, by_mass, strict=True)]


def missed(kind: ContactKind, rows: RowValues) -> Named:
    """Return what is missed at a state (see `missed_by`)."""
    acts = map(ModeNodes(kind.mechanism).acts, kind.mechanism.rows)
    return missed_by(row_motions(kind.motion), list(acts))


def ends_of_normal(kind: ContactKind, rows: RowValues) -> Named:
    """Return when a contact closes or opens."""
    values = ModeValues(kind.motion).functions(kind.leaves["rows"])
    return {"values": [as_node(x) for name, x in values.items() if is_of_normal(name)]}


def ends_of_touching(kind: ContactKind, rows: RowValues) -> Named:
    """Return when else the mode of a contact that touches ends."""
    values = ModeValues(kind.motion).functions(kind.leaves["rows"])
    return {"values": [as_node(x) for name, x in values.items() if not is_of_normal(name)]}


def _frictions(kind: ContactKind) -> list[Friction]:
    """Return what rubs where a contact touches."""
    own, values, found = kind.leaves, ModeValues(kind.motion), list[Friction]()
    places = {row.name: k for k, row in enumerate(kind.mechanism.rows)}
    for k, (element, part) in enumerate(friction_parts(kind.mechanism)):
        tangents = [places[row.name] for row in part.rows]
        forces = values.friction(part, [own["phidot"][j] for j in tangents], own["limits"][2 * k : 2 * k + 2])
        normals = [places[row.name] for row in element.normals_of(part)]
        found.append(Friction(normals, [ONE] * len(normals), tangents, forces, norm=False))
    return found


def _less(values: Sequence[Node], rows: Iterable[Row], x: Sequence[Node]) -> list[Node]:
    return [value - times(row, x) for value, row in zip(values, rows, strict=True)]


# --- the same for any row ---------------------------------------------------------------------------------------------


def elements(rows: Iterable[Row]) -> list[Node]:
    """Return the elements of rows one after the other, each row's in the order of its columns."""
    return [row[k] for row in rows for k in sorted(row)]


def baumgarte(row: DeclaredRow, phi: Node, phidot: Node, alpha_beta: Sequence[Node]) -> Node:
    """Return Baumgarte's term of a row (see `system.stabilised`)."""
    alpha, beta = alpha_beta
    return -2 * alpha * phidot - beta**2 * phi if row.is_holonomic else -alpha * phidot


def of_moving(row: Row, by_mass: Row, held: Sequence[Node], some: Node) -> Row:
    """Return a row of the speeds that are not held where `some` are, else that of all of them by mass."""
    least = sum((absolute(h) * held[j] for j, h in row.items()), ZERO)
    moving = {j: chosen(held[j], ZERO, felt(h, least)) for j, h in row.items()}
    return {j: chosen(some, moving.get(j, ZERO), by_mass.get(j, ZERO)) for j in sorted({*moving, *by_mass})}


def missed_by(rows: Sequence[RowMotion], acts: Sequence[Node]) -> Named:
    """Return phi and the `residual` phidot of the rows that act, zeros for the others."""
    pairs = list(zip(rows, acts, strict=True))
    return {
        "phi": [chosen(acting, row.phi if row.holonomic else ZERO, ZERO) for row, acting in pairs],
        "residual": [chosen(acting, row.phidot, ZERO) for row, acting in pairs],
    }
