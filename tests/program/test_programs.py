"""The named set of a system: sizes, order, and what does not belong together."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from multibody_sym.program.program import Program
from multibody_sym.program.programs import Programs
from multibody_sym.program.statements import Array, ProgramError, ShapeError
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import Node, number

SIZES = {"q": 3, "u": 2, "parameters": 5, "inputs": 1, "modes": 0}
INPUTS = (Array("t"), *(Array(name, (size,)) for name, size in SIZES.items()))


def constants(name: str, sizes: Mapping[str, int | None], inputs: tuple[Array, ...] = INPUTS) -> Program:
    def values(size: int | None) -> tuple[tuple[int, ...], list[Node]]:
        return ((), [number(1)]) if size is None else ((size,), [number(1)] * size)

    return Trace(name, inputs).finish({output: values(size) for output, size in sizes.items()})


def parts(rows: int = 1) -> dict[str, Program | None]:
    derivative = {"qdot": 3, "udot": 2, "multipliers": rows, "report": 3}
    return {
        "inputs": constants("inputs", {"inputs": 1}, INPUTS[:4]),
        "state_derivative": constants("state_derivative", derivative),
        "project_position": constants("project_position", {"phi": rows, "correction": 3}) if rows else None,
        "project_velocity": constants("project_velocity", {"residual": rows, "correction": 2}) if rows else None,
        "normalize": constants("normalize", {"q": 3, "deviation": None}),
        "energy": constants("energy", {"kinetic": None, "potential": None}),
        "outputs": constants("outputs", {"values": 4}),
    }


def made(given: Mapping[str, Program | None]) -> Programs:
    return Programs(**given)  # type: ignore[arg-type]


def test_sizes_follow_from_the_arrays() -> None:
    programs = made(parts())
    sizes = [programs.nq, programs.nu, programs.ns, programs.np, programs.nw, programs.nm, programs.no]
    assert sizes == [3, 2, 1, 5, 1, 0, 4]


def test_the_mapping_has_what_there_is_in_the_order_of_the_fields() -> None:
    assert list(made(parts()).as_mapping()) == list(parts())
    free = parts(rows=0) | {"normalize": None}
    assert list(made(free).as_mapping()) == ["inputs", "state_derivative", "energy", "outputs"]
    assert made(free).ns == 0


@pytest.mark.parametrize(
    ("error", "wrong"),
    [
        (ProgramError, {"energy": constants("energies", {"kinetic": None, "potential": None})}),
        (ProgramError, {"energy": constants("energy", {"potential": None, "kinetic": None})}),
        (ProgramError, {"energy": constants("energy", {"kinetic": None, "potential": None}, INPUTS[1:])}),
        (ProgramError, {"project_position": None}),
        (ProgramError, {"project_velocity": None}),
        (ShapeError, {"energy": constants("energy", {"kinetic": 1, "potential": None})}),
        (ShapeError, {"project_velocity": constants("project_velocity", {"residual": 1, "correction": 3})}),
        (ShapeError, {"project_position": constants("project_position", {"phi": 2, "correction": 3})}),
        (ShapeError, {"inputs": constants("inputs", {"inputs": 2}, INPUTS[:4])}),
        (ShapeError, {"outputs": constants("outputs", {"values": 4}, (*INPUTS[:5], Array("modes", (1,))))}),
    ],
)
def test_what_does_not_belong_together_is_refused(error: type[ProgramError], wrong: dict[str, Program | None]) -> None:
    with pytest.raises(error) as caught:
        made(parts() | wrong)
    assert type(caught.value) is error


def test_rows_without_projections_and_projections_without_rows_are_refused() -> None:
    with pytest.raises(ProgramError):
        made(parts(rows=0) | {name: parts()[name] for name in ("project_position", "project_velocity")})
