"""Files of `tests/published`: a model with its source below `published:`, and cases with the source's values.

`published:` has the `source`, what the case `tests`, the `accuracy` of its values, and perhaps which of them are
`left_out`, with the reason. `expect:` is that of `problem_files.py`. A tolerance is how good the source is.
A closed form, where there is one, is the reference.
"""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from problem_files import command_of_case, compared, letters_of, model_of_case, read_problem

from multibody_sym.cli.main import main

PUBLISHED = Path(__file__).parent / "published"


@dataclass(frozen=True)
class PublishedCase:
    """A published case: its title, source, what it tests, how accurate its values are, the model and the runs.

    `left_out`: the source's values that are not compared, and why.
    """

    name: str
    title: str
    source: str
    tests: str
    accuracy: str
    model: str
    runs: tuple[Mapping[str, Any], ...]
    left_out: str = ""


@dataclass(frozen=True)
class Comparison:
    """A value of a case: its name, the source's value, the one found, and the source's accuracy; SI units."""

    quantity: str
    reference: float
    ours: float
    accuracy: float

    @property
    def difference(self) -> float:
        """How far both are apart."""
        return abs(self.ours - self.reference)


def published_cases() -> dict[str, Path]:
    """Return the file of each case by name."""
    return {path.stem: path for path in sorted(PUBLISHED.glob("*.yaml"))}


def read_published(path: Path) -> PublishedCase:
    """Return the case in a file."""
    text, runs = read_problem(path)
    model, mark, facts = text.partition("\npublished:\n")
    assert mark, f"{path}: no source"
    title = model.partition("\n")[0].removeprefix("# ").partition(". ")[0].rstrip(".")
    return PublishedCase(path.stem, title, model=model + "\n", runs=tuple(runs), **yaml.safe_load(facts))


def comparisons(case: PublishedCase) -> Iterator[Comparison]:
    """Run a case and yield its values beside the source's."""
    for run in case.runs:
        found = _answer(case, run)
        for path, ours, expected in compared(found, run, letters_of(case.model, {})):
            yield Comparison(_quantity(path, found), expected.expected, ours, expected.abs)


def _answer(case: PublishedCase, run: Mapping[str, Any]) -> Any:
    """Return the object that the command of a run prints."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{case.name}.yaml"
        path.write_text(model_of_case(case.model, run), encoding="utf-8")
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as messages:
            code = main(command_of_case(str(path), run))
    assert code == 0, messages.getvalue()
    return json.loads(out.getvalue())


def _quantity(path: str, found: Any) -> str:
    """Return the name of the quantity at a path, with its time where it is one of a column."""
    kind, _, rest = path.partition(".")
    name, _, row = rest.rpartition(".")
    if kind in ("coordinates", "speeds", "outputs") and name:
        return f"{name} at {found['t'][int(row)]:g} s"
    if kind == "events":
        event, detail = found["events"][int(name)], {"t": "time"}.get(row, row)
        return f"{detail} of {event['kind']} {event['element']}"
    if kind == "modes":
        return f"{row} of mode {int(name) + 1}"
    return rest
