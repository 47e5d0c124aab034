"""The notebooks under examples run from a fresh kernel's first cell to the last, and hold what their cells show."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def test_there_are_four() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["four_bar", "from_python_to_c", "pulley_and_incline", "small_motions"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_cells_run_in_order_and_show_what_is_stored(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(FOLDER)
    names: dict[str, Any] = {}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] != "code":
            continue
        shown = value_of("".join(cell["source"]), names)
        (stored,) = [output["data"] for output in cell["outputs"]]
        assert "error" not in {output["output_type"] for output in cell["outputs"]}
        if "<" in repr(shown)[:1]:  # what has a line that says what it is
            assert repr(shown).split()[0] == "".join(stored["text/plain"]).split()[0]


def value_of(source: str, names: dict[str, Any]) -> Any:
    """Run a cell and return its last expression, as a notebook shows it."""
    *statements, last = ast.parse(source).body
    exec(compile(ast.Module(statements, []), "cell", "exec"), names)
    assert isinstance(last, ast.Expr)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)
