"""Which parts of the runtime a model enters: the others are neither compiled nor linked."""

from __future__ import annotations

from collections.abc import Mapping

from multibody_sym.program.program import Program
from multibody_sym.program.statements import Callee, Solve, callees


def parts_of(programs: Mapping[str, Program], *, multistep: bool = True) -> frozenset[str]:
    """Return the parts that runs of some Programs may enter; a run with events may come into modes with rows.

    `multistep`: whether methods that look back are among those that run them.
    """
    implicit = bool({"jacobian", "index_2"} & programs.keys())
    events = "events" in programs
    rows = bool({"put_back", "project_position", "project_velocity"} & programs.keys())
    wanted = {"rows": rows or implicit or events or _solves(programs), "events": events, "implicit": implicit}
    wanted["multistep"] = multistep and "state_derivative" in programs
    return frozenset(part for part, enters in wanted.items() if enters)


def _solves(programs: Mapping[str, Program]) -> bool:
    """Tell whether one of the Programs, or of those that they run, solves equations of rows."""
    left: list[Callee] = list(programs.values())
    seen: set[int] = set()
    while left:
        program = left.pop()
        if id(program) not in seen:
            seen.add(id(program))
            if any(isinstance(statement, Solve) for statement in program.statements):
                return True
            left += [callee for statement in program.statements for callee in callees(statement)]
    return False
