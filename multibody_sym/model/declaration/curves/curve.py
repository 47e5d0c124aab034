"""Curves in a plane or in space: where they lead, as expressions of their parameter."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final

from multibody_sym.errors import ModelError
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.fields import Element, Record, holds
from multibody_sym.model.declaration.values import AXES, Choice, Point, Scalar, Text
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.kinks import switching_functions
from multibody_sym.scalars.node import ZERO, Node, as_node, quantity, symbol
from multibody_sym.scalars.traversal import leaves

PARAMETER: Final = "parameter of a curve"
"""What the leaf of a parameter is called, with its name and unit: no name of the model, though one may be the same."""
_UNITS: Final = ("rad", "m")
_EXAMPLE: Final = '{y: "x^2/2"}, or {x: "2*cos(s)", y: "sin(s)", parameter: s}'


@dataclass(frozen=True, kw_only=True)
class Curve(Element):
    """A smooth curve: `y` (or x, z) as an expression of x (or y, z), or `x`, `y`, `z` of a `parameter`.

    Without a `parameter` that is the coordinate that is not given: `{y: "x^2/(2*p)"}`; with one, what is left out is
    zero: `{x: "R*(s - sin(s))", y: "-R*(1 - cos(s))", parameter: s}`. Expressions name parameters of the model too, and
    t where a wire moves or bends by itself. The parameter is in m where it is a coordinate, else an angle, unless
    `unit` says the other (m, rad). Lengths are in m, along the axes of the frame that carries the curve.
    """

    x: Node | None = holds(
        Scalar("m"), None, says="x as an expression of the parameter, or of y or z", such="R*(s - sin(s))"
    )
    y: Node | None = holds(Scalar("m"), None, says="y as an expression of the parameter, or of x", such="x^2/(2*p)")
    z: Node | None = holds(Scalar("m"), None, says="z as an expression of the parameter, or of x and y", such="h*s")
    parameter: str | None = holds(
        Text(), None, says="the name of the parameter; if left out the coordinate that is not given", such="s"
    )
    unit: str | None = holds(
        Choice(_UNITS), None, says="the unit of the parameter, where it is not what it seems", such="m"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        leaf = self.leaf
        for name, node in self._given.items():
            object.__setattr__(self, name, _exchanged(node, symbol(leaf.data[1][0]), leaf))
        self.__dict__.pop("_given", None)

    def verify(self) -> None:
        given = self._given
        if not given or (self.parameter is None and len(given) == len(AXES)):
            raise ModelError(f"say where the curve leads, by expressions of its parameter: {_EXAMPLE}")
        own = (self.leaf, symbol(self.leaf.data[1][0]))
        for name, node in given.items():
            if any(_depends(g, own) for g in switching_functions([node])):
                raise ModelError(
                    "a curve that guides is smooth, and this has a kink or a jump; declare a smooth part of it"
                ).under(name)
        if self.parameter is not None and not any(_depends(node, own) for node in given.values()):
            raise ModelError(f"no coordinate of the curve names {self.parameter!r}: {_EXAMPLE}").under("parameter")

    @cached_property
    def _given(self) -> dict[str, Node]:
        return {name: node for name in AXES if (node := getattr(self, name)) is not None}

    @property
    def leaf(self) -> Node:
        """What stands for its parameter, with name and unit."""
        given = self._given.values()
        made = (leaf for leaf in leaves(given, "quantity") if leaf.data[0] == PARAMETER)
        return next(made, None) or quantity(PARAMETER, self._named(given))

    def _named(self, given: Any) -> tuple[str, str]:
        if self.parameter is not None:
            plain = "m" if symbol(self.parameter) in given else "rad"
            return self.parameter, self.unit or plain
        named = {leaf.data for leaf in leaves(given, "symbol")}
        others = [name for name in AXES if name not in self._given]
        return next((name for name in others if name in named), (others or AXES)[0]), "m"

    @property
    def unit_of_parameter(self) -> str:
        """The unit of its parameter."""
        unit: str = self.leaf.data[1][1]
        return unit

    @property
    def place(self) -> Point:
        """Where it leads, as expressions of its parameter's leaf."""
        own = {} if self.parameter is not None else {self.leaf.data[1][0]: self.leaf}
        x, y, z = ({**own, **self._given}.get(name, ZERO) for name in AXES)
        return x, y, z


@dataclass(frozen=True)
class CurveField:
    """A curve; a file holds its parameter by name."""

    def accept(self, value: Any) -> Element:
        return Record(Curve).accept(value)

    def tree(self, value: Curve) -> dict[str, Any]:
        leaf = value.leaf
        found = {name: text(_exchanged(node, leaf, symbol(leaf.data[1][0]))) for name, node in value._given.items()}
        words = {"parameter": value.parameter, "unit": value.unit}
        return found | {name: word for name, word in words.items() if word is not None}


def _exchanged(node: Node, old: Node, new: Node) -> Node:
    return as_node(evaluate([node], lambda leaf: new if leaf is old else leaf)[0])


def _depends(node: Node, any_of: tuple[Node, ...]) -> bool:
    return any(leaf in any_of for op in ("symbol", "quantity") for leaf in leaves([node], op))
