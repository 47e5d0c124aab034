"""Compare the Programs of all modes with those of each mode alone in runs of random models.

    python tests/every_mode_runs.py TABLE --seed TEXT --models 5000

TABLE is a file of JSON lines, one for each model; what is started again goes on after what stands there. Each says how
many modes were entered, by kind of value the largest difference relative to the largest value of its kind, and the
smallest part that rows of a mode leave each other. TEXT, such as the hash of a commit, chooses the models.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from random_models import random_model
from random_runs import seed_of

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.law_programs import friction_power_program
from multibody_sym.dynamics.programs.reactions import switchings
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.errors import MultibodyError
from multibody_sym.motion.switching.legs import ModeLeg
from multibody_sym.motion.switching.modes import function_of
from multibody_sym.program.program import interpret

MOST_TIME = 1.0
"""CPU seconds after which a run has entered enough modes: a few that hit and hop on and on take most of the time."""
INDEPENDENT = 1e-6
"""Smallest part of a row that others leave from which on accelerations are compared."""


def modes_of(text: str, until: float, backend: str = "c") -> list[ModeLeg]:
    """Return the first leg of each mode in which a run of a model is whose Programs serve all modes.

    The run has large steps: it only has to enter modes, and is three quarters of the time of a comparison.
    """
    prepared = mbs.prepare(mbs.loads(text), t_end=until, samples=3, backend=backend, rtol=1e-4, atol=1e-6)
    over = time.process_time() + MOST_TIME

    def end(*_: object) -> None:
        if time.process_time() > over:
            raise KeyboardInterrupt  # which ends a run, and keeps the modes that it has entered

    try:
        run = prepared.run(on_progress=end)
    except mbs.RunError as error:
        run = error.trajectory
    found = {leg.program.key: leg for leg in (run.modes.legs if run.modes else ())}
    return [leg for leg in found.values() if leg.program.mechanism.mode_numbers]


def compared(leg: ModeLeg) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield what the Programs of the mode alone and those of all modes say where a leg begins."""
    entered, every, problem = leg.program.entered, leg.program.mechanism, leg.problem
    alone, acting = np.array(leg.parameters), [row.name for row in entered.rows]
    acting = [k for name in acting for k, row in enumerate(every.rows) if row.name == name]
    made = programs(entered, FORMALISMS["composite_body"]).as_mapping()
    state = problem.start, problem.q0, problem.u0
    inputs = interpret(made["inputs"], *state, alone)[0]
    of_mode, of_all = (alone, inputs, np.zeros(0)), (problem.parameters, inputs, problem.modes)

    def both(name: str, *more: tuple[np.ndarray, np.ndarray]) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        given = [*state, *of_mode, *(x for x, _ in more)][: len(made[name].inputs)]
        first = interpret(made[name], *given)
        return zip(first, problem.compiled[name](*state, *of_all, *(x for _, x in more)), strict=True)

    qdot, udot, forces, report = both("state_derivative")
    yield "qdot", *qdot
    if report[0][0] < len(acting) and not all(row.restricts for row in entered.rows):
        return  # what presses is not unique, and each takes it of least norm in its own unknowns
    yield from (("udot", *udot), ("multipliers", forces[0], forces[1][acting]))
    if acting:
        yield from (("correction", *pair) for pair in both("put_back"))
    friction = friction_power_program(entered), friction_power_program(every)
    given = (*of_mode, forces[0]), (*of_all, forces[1])
    powers = [interpret(program, *state, *own) for program, own in zip(friction, given, strict=True)]
    yield from (("powers", *pair) for pair in zip(*powers, strict=True))
    functions = [function_of(one) for one in switchings(entered)]
    names = [None if one is None else function_of(one) for one in leg.program.switchings]
    if "events" not in made:  # no stop, and no function at which the mode ends
        assert set(names) <= {None}
        return
    ((values, of_every),) = both("events", forces)
    first = len(values) - len(functions)
    yield "stops", values[:first], of_every[:first]
    yield "functions", values[first:], of_every[first:][[names.index(name) for name in functions]]
    assert all(of_every[first + k] < 0.0 for k, name in enumerate(names) if name is None)


def differences(text: str, until: float) -> Iterator[dict[str, float]]:
    """Yield for each mode the relative differences by kind, and what rows leave each other, `left`."""
    for leg in modes_of(text, until, "python"):
        problem = leg.problem
        inputs = problem.compiled["inputs"](problem.start, problem.q0, problem.u0, problem.parameters)[0]
        given = problem.start, problem.q0, problem.u0, problem.parameters, inputs, problem.modes
        found = {"left": float(problem.compiled["state_derivative"](*given)[3][1])}
        for name, alone, every in compared(leg):
            size = max(1.0, float(np.abs(alone).max(initial=0.0)))
            found[name] = max(found.get(name, 0.0), float(np.abs(alone - every).max(initial=0.0)) / size)
        yield found


def main() -> None:
    """Run the models that the table does not have, and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--seed", required=True)
    parser.add_argument("--models", type=int, default=5000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--until", type=float, default=0.3)
    given = parser.parse_args()
    done = given.table.read_text().splitlines() if given.table.exists() else []
    known = {json.loads(line)["model"] for line in done}
    with given.table.open("a") as table:
        for number in range(given.first, given.models):
            if number not in known:
                table.write(json.dumps(outcome(given.seed, number, given.until)) + "\n")
                table.flush()
    print(json.dumps(summary(list(map(json.loads, given.table.read_text().splitlines())))))


def outcome(seed: str, number: int, until: float) -> dict[str, Any]:
    """Return the row of a model."""
    try:
        return {"model": number, "modes": list(differences(random_model(seed_of(seed, number)), until))}
    except MultibodyError as error:
        return {"model": number, "modes": [], "refused": str(error)[:200]}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return counts, and the worst differences where rows are independent enough, and where they are not."""
    modes = [mode for row in rows for mode in row["modes"]]
    clear = [mode for mode in modes if mode["left"] >= INDEPENDENT or mode["left"] == 0.0]
    served = sum(bool(row["modes"]) for row in rows)
    found: dict[str, Any] = {"models": len(rows), "served": served, "modes": len(modes)}
    for name, of in (("clear", clear), ("nearly dependent", [mode for mode in modes if mode not in clear])):
        kinds = {kind for mode in of for kind in mode if kind != "left"}
        found[name] = {kind: max(mode.get(kind, 0.0) for mode in of) for kind in sorted(kinds)}
    return found


if __name__ == "__main__":
    main()
