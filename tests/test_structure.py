"""The shape of the package: no import cycle, no endless file or function, and no early import of scipy."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from package_trees import PACKAGE, nodes, trees

from multibody_sym.program.runtime_constants import constants_header

FILES = {path.relative_to(PACKAGE.parent): path.read_text(encoding="utf-8") for path in sorted(PACKAGE.rglob("*.py"))}
LONGEST_FILE, LONGEST_FUNCTION = 900, 60


def module_name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


@cache
def modules() -> dict[str, ast.Module]:
    return {module_name(Path(PACKAGE.name, name)): tree for name, tree in trees().items()}


@cache
def within() -> dict[str, tuple[ast.AST, ...]]:
    return {module_name(Path(PACKAGE.name, name)): found for name, found in nodes().items()}


def imported(name: str) -> set[str]:
    """Return the modules of the package that one imports anywhere: at its head, in functions, for types alone.

    The root hands out names that other modules own when they are asked for, and imports none of them itself.
    """
    found = set()
    for node in within()[name]:
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return (found & set(modules())) - {name, "multibody_sym"}


def cycles(edges: dict[str, set[str]]) -> list[str]:
    """Return the modules that lead back to themselves."""
    left = {name: set(targets) for name, targets in edges.items()}
    while True:
        ends = {name for name, targets in left.items() if not targets}
        if not ends:
            return sorted(left)
        left = {name: targets - ends for name, targets in left.items() if name not in ends}


def functions(every: Iterable[ast.AST]) -> Iterator[ast.FunctionDef]:
    return (node for node in every if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)))


def length(function: ast.FunctionDef) -> int:
    """Return the lines of a function from its name on, those of its docstring apart."""
    first = function.body[0]
    docstring = first.end_lineno - first.lineno + 1 if ast.get_docstring(function) is not None else 0
    return function.end_lineno - function.lineno + 1 - docstring


def test_no_module_leads_back_to_itself() -> None:
    assert cycles({"a": {"b"}, "b": {"a", "c"}, "c": set()}) == ["a", "b"]
    assert cycles({name: imported(name) for name in modules()}) == []


C_SOURCES = sorted((PACKAGE.parent / "templates/c").glob("*.[ch]"))
C_FILES = {path.name: path.read_text(encoding="utf-8") for path in C_SOURCES}
STAND_INS = {name for name in C_FILES if name.startswith("no_")}


def without_comments(text: str) -> str:
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def test_no_c_file_includes_itself() -> None:
    includes = {name: set(re.findall(r'#include "(\S+)"', text)) & set(C_FILES) for name, text in C_FILES.items()}
    assert includes["implicit.c"] == {"stages.h"}
    assert cycles(includes) == []


def test_no_c_unit_calls_back_into_itself() -> None:
    """A unit may use what others define, but none of those that use it: methods are reached through `mbs_stepper`."""
    units = {name: without_comments(C_FILES[name]) for name in C_FILES if name.endswith(".c") and name not in STAND_INS}
    define = re.compile(r"^(?!static|extern|typedef|#)\w[\w *]*?\b(mbs_\w+)\s*(?:\([^;{]*\)\s*\{|=)", re.MULTILINE)
    homes = {symbol: name for name, text in units.items() for symbol in define.findall(text)}
    assert homes["mbs_integrate"] == "runtime.c"
    assert homes["mbs_implicit"] == "implicit.c"
    uses = {name: {homes[x] for x in re.findall(r"\bmbs_\w+", text) if x in homes} for name, text in units.items()}
    assert cycles({name: others - {name} for name, others in uses.items()}) == []


def test_every_c_unit_is_in_the_map() -> None:
    drawn = re.findall(r"^       (\w+\.[ch])  ", C_FILES["runtime.c"], flags=re.MULTILINE)
    assert {name for name in C_FILES if name.endswith(".c")} - STAND_INS <= set(drawn)


TWINS = ("motion/integrator/", "motion/loop/", "program/", "scalars/")
"""Where Python does what C does; elsewhere a name and a number may meet by chance."""
NUMBER = re.compile(r"^#define (?:MBS_)?([A-Z_]+) \(?([\d.][-+.\w]*)\)?(?: +/|$)", re.MULTILINE)


def constants_of_python() -> Iterator[tuple[str, str, float]]:
    """Yield the file, the name without its underscore, and the value of the numbers that modules call by a name."""
    for path, tree in trees().items():
        for node in tree.body:
            target = node.target if isinstance(node, ast.AnnAssign) else None
            if isinstance(target, ast.Name) and target.id.isupper():
                with suppress(ValueError, TypeError, NameError):
                    value = eval(ast.unparse(node.value), {"EPSILON": 2.0**-52, "float_info": sys.float_info})
                    if isinstance(value, (int, float)):
                        yield str(path), target.id.lstrip("_"), float(value)


def test_constants_that_python_and_c_share_are_written_once() -> None:
    """A constant of C alone has another name or value than those of Python, which writes the header for both."""
    shared = dict(re.findall(r"^#define MBS_([A-Z_]+) ([\d.][-+.\w]*)", constants_header(), flags=re.MULTILINE))
    assert len(shared) > 80
    of_c = {(name, number) for text in C_FILES.values() for name, number in NUMBER.findall(text)}
    assert NUMBER.findall("#define MBS_PART 1e-5 /* of a row */") == [("PART", "1e-5")]
    assert {name for name, _ in of_c} & set(shared) == set()
    numbers = {(name, float.fromhex(x) if x.startswith("0x") else float(x)) for name, x in of_c}
    of_python = list(constants_of_python())
    assert numbers & {(name, value) for _, name, value in of_python} == set()
    homes: dict[str, list[str]] = {name: [] for name in shared}
    for path, name, value in of_python:
        if path.startswith(TWINS) and name in shared and value == float(shared[name]):
            homes[name].append(path)
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}


def listed(docstring: str) -> list[str]:
    """Return the names in the lines `    name, name  words` of a folder's docstring."""
    lines = re.findall(r"^ {4}(\w+(?:, \w+)*)  +\S", docstring, flags=re.MULTILINE)
    return [name for names in lines for name in names.split(", ")]


def test_each_folder_lists_its_files_and_folders() -> None:
    """Once each: who looks for a behaviour reads these lists."""
    assert listed("A room.\n\n    a, import_  this\n    b    that\n    x = 2 y,  z\n\nIn: c.") == ["a", "import_", "b"]
    folders = {path.parent: text for path, text in FILES.items() if path.name == "__init__.py"}
    there: dict[Path, list[str]] = {folder: [] for folder in folders}
    for path in [*(path for path in FILES if path.name != "__init__.py"), *folders]:
        if path.parent in folders:
            there[path.parent].append(path.stem)
    named = {folder: listed(ast.get_docstring(ast.parse(text), clean=False) or "") for folder, text in folders.items()}
    wrong = {str(x): (set(there[x]) - set(named[x]), set(named[x]) - set(there[x])) for x in folders}
    assert {folder: names for folder, names in wrong.items() if any(names)} == {}
    assert [str(x) for x in folders if len(named[x]) != len(there[x])] == []


def test_no_file_is_long() -> None:
    lines = {str(path): text.count("\n") for path, text in FILES.items()}
    assert {path: n for path, n in lines.items() if n > LONGEST_FILE} == {}


def test_no_function_is_long() -> None:
    long = {
        f"{name}.{function.name}": length(function)
        for name, every in within().items()
        for function in functions(every)
        if length(function) > LONGEST_FUNCTION
    }
    assert long == {}


def test_scipy_is_imported_only_by_what_computes_with_it() -> None:
    """It takes half a second to import, and most commands need none of it."""
    early = [
        name
        for name, tree in modules().items()
        for node in tree.body
        if isinstance(node, (ast.Import, ast.ImportFrom)) and ast.unparse(node).split()[1].startswith("scipy")
    ]
    assert early == []


LIMITS_STAND_IN = {"scalars/limits.py", "mechanics/joint_friction.py"}
"""The formulas of friction, and where the coefficient of what turns is that of its arm."""


def is_coefficient(node: ast.AST) -> bool:
    name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
    return name in ("static", "kinetic")


def test_what_friction_allows_stands_once():
    products = {
        str(path)
        for path, found in nodes().items()
        for node in found
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)
        if any(is_coefficient(x.operand if isinstance(x, ast.UnaryOp) else x) for x in (node.left, node.right))
    }
    assert products == LIMITS_STAND_IN


def test_what_friction_leaves_of_its_cone_is_a_difference_in_one_place():
    """`room`; over arrays that of `laws`, whose coefficients may be large."""
    differences = {
        str(path)
        for path, found in nodes().items()
        for node in found
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub)
        if any(is_call_of(x, "most") for x in (node.left, node.right))
    }
    assert differences == {"scalars/limits.py", "contact_laws/problem.py"}


def test_which_limits_a_mode_has_is_told_in_one_place():
    """Conditions and forces that are open read its list; switching functions are made of it."""
    makers = {str(path) for path, found in nodes().items() for node in found if is_call_of(node, "Limit")}
    readers = {str(path) for path, found in nodes().items() for node in found if is_call_of(node, "limits_in")}
    assert makers == {"mechanics/law_elements.py"}
    assert readers == {"dynamics/programs/reactions.py"}


def is_call_of(node: ast.AST, name: str) -> bool:
    function = node.func if isinstance(node, ast.Call) else None
    return isinstance(function, ast.Name) and function.id == name


def is_of(node: ast.AST, *names: str) -> bool:
    return isinstance(node, ast.Attribute) and node.attr in names


def test_which_forces_press_a_friction_part_and_their_factors_in_N_stand_once():
    """Rows of an element by their places among its normals; over arrays, `base` times the forces of these rows."""
    chosen = {
        str(path)
        for path, found in nodes().items()
        for node in found
        if isinstance(node, ast.ListComp | ast.GeneratorExp) and any(is_of(x.iter, "normals") for x in node.generators)
        if any(isinstance(x, ast.Subscript) and is_of(x.value, "normals") for x in ast.walk(node.elt))
    }
    weighted = {
        str(path)
        for path, found in nodes().items()
        for node in found
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.MatMult)
        if is_of(node.left, "base") or is_of(node.right, "base")
    }
    assert (chosen, weighted) == ({"mechanics/law_elements.py"}, {"contact_laws/problem.py"})


def test_how_elements_stand_what_touches_and_which_problem_they_pose_is_defined_once():
    names = [function.name for found in nodes().values() for function in functions(found)]
    assert [names.count(name) for name in ("posed", "standing", "touching")] == [1, 1, 1]


def test_benchmarks_import_names_that_the_package_has():
    found = [
        (path.name, node.module, name.name)
        for path in sorted((PACKAGE.parent / "benchmarks").glob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module is not None and node.module.startswith("multibody_sym.")
        for name in node.names
    ]
    assert len(found) > 100
    missing = [each for each in found if not hasattr(import_module(each[1]), each[2])]
    assert not [each for each in missing if find_spec(f"{each[1]}.{each[2]}") is None]
