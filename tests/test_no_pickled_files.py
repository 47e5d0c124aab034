"""No file of the package is a pickle: nothing in it, in its templates or in what it generates writes or reads one."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from package_trees import nodes

ROOT = Path(__file__).parents[1]
MODULES = {"pickle", "_pickle", "cPickle", "marshal", "shelve", "dbm", "dill", "cloudpickle", "joblib", "jsonpickle"}
CALLS = {"np.load", "np.save", "np.lib.format.write_array", "np.lib.format.read_array"}
TEMPLATES = sorted((ROOT / "templates").rglob("*.py"))


def forbidden(within: Iterable[ast.AST]) -> Iterator[str]:
    """Yield imports of what writes or reads pickles, by whatever statement, and arrays that may hold them."""
    for node in within:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.partition(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in MODULES:
            yield str(node.module)
        elif isinstance(node, ast.Constant) and node.value in MODULES:
            yield f"the name {node.value!r}, as import_module takes it"
        elif isinstance(node, ast.keyword) and node.arg == "allow_pickle" and ast.unparse(node.value) != "False":
            yield "allow_pickle"
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in CALLS and not _decides(node):
            yield f"{ast.unparse(node.func)} without allow_pickle=False"


def _decides(call: ast.Call) -> bool:
    return any(word.arg == "allow_pickle" for word in call.keywords)


@pytest.mark.parametrize(
    "source",
    [
        "import pickle", "import os, marshal as m", "from shelve import open", "def f():\n    from pickle import loads",
        "import_module('dill')", "np.load(f)", "np.load(f, allow_pickle=True)", "np.save(f, x, allow_pickle=flag)",
    ],
)
def test_each_way_is_seen(source: str) -> None:
    assert list(forbidden(ast.walk(ast.parse(source))))


def test_no_file_of_the_package_is_a_pickle() -> None:
    every = {**nodes(), **{str(path): tuple(ast.walk(ast.parse(path.read_text()))) for path in TEMPLATES}}
    assert len(every) > 200
    assert {name: found for name, within in every.items() if (found := list(forbidden(within)))} == {}
