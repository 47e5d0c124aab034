"""The Python reference, one page a group: signature, parameters, types, returns, errors and an example of each name."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

import multibody_sym as mbs
from multibody_sym.model.fields import Element
from multibody_sym.model.schema import default_of, kind_of, with_types
from multibody_sym.text.yaml_tree import read_text
from site_pages.markdown import block, cell, code, paragraphs, plain, table
from site_pages.model_file import anchors
from site_pages.python_words import GROUPS, PARAMETERS

EXAMPLES = dict(
    re.findall(
        r"^## (\w+)\n\n```python\n(.*?)\n```$",
        (Path(__file__).parent / "python_examples.md").read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
)
_ERRORS = re.compile(r"\b(?:Motion\w*|FailedRun|NoSolution|UndefinedValue|[A-Z][a-z]+)Error\b")


def pages() -> Mapping[str, Callable[[], str]]:
    """Return how to make each page."""
    groups = {f"reference/python/{address}.md": partial(_page, address) for address in GROUPS}
    return {"reference/python_api.md": _overview, **groups}


def _overview() -> str:
    parts = [
        "# Python API\n\n`import multibody_sym as mbs`. Numbers are SI, angles in radians. "
        'Wherever a number is expected, a text with a unit such as `"30 deg"` is read, too.\n'
    ]
    for address, group in GROUPS.items():
        links = ", ".join(f"[`{name}`](python/{address}.md#{name.lower()})" for name in group.names)
        about = group.about.replace("(../", "(")
        parts.append(f"## [{group.title}](python/{address}.md)\n\n{about}\n\n{links}\n")
    return "\n".join(parts)


def _page(address: str) -> str:
    group = GROUPS[address]
    head = f"# Python: {group.title[0].lower()}{group.title[1:]}\n\n{group.about}\n"
    if address == "expressions":
        return "\n".join([head, _mathematics(), *(_entry(name) for name in group.names if name not in MATHEMATICS)])
    return "\n".join([head, *map(_entry, group.names)])


MATHEMATICS = {
    "sin": "sine of an angle in rad", "cos": "cosine of an angle in rad", "tan": "tangent of an angle in rad",
    "asin": "arc sine in rad", "acos": "arc cosine in rad", "atan": "arc tangent in rad", "exp": "exponential",
    "log": "natural logarithm", "sqrt": "square root", "absolute": "absolute value", "sign": "-1, 0 or 1",
}  # fmt: skip


def _mathematics() -> str:
    """Return the functions of one number, which share parameter, type and errors."""
    rows = [(f"`{name}(a)`", words) for name, words in MATHEMATICS.items()]
    heads = "\n".join(f"### {name}\n\n`{name}(a)` returns the {words}.\n" for name, words in MATHEMATICS.items())
    example = block("height = 2 * mbs.sin(mbs.t) + mbs.sqrt(mbs.exp(1.0))", "python")
    return (
        f"## Functions of one number\n\n{table(('function', 'returns'), rows)}\n`a` is a number or an expression. They "
        "return a number or an expression. They raise `InputError` for other types and outside their domain.\n\n"
        f"{example}\n{heads}"
    )


def _entry(name: str) -> str:
    value = getattr(mbs, name)
    if isinstance(value, type) and issubclass(value, Element):
        body = _element(value)
    elif isinstance(value, type):
        body = _result(value)
    elif inspect.isfunction(value):
        body = _function(value)
    else:
        body = f"{code(repr(value)[:80])}, the time in s\n" if name == "t" else f"{code(repr(value)[:80])}\n"
    return f"## {plain(name)}\n\n{body}\n{block(example(name), 'python')}"


def example(name: str) -> str:
    """Return the example of a public name; that of an element is made of the examples of its keys."""
    return EXAMPLES.get(name) or _element_example(getattr(mbs, name))


def _function(function: Any) -> str:
    signature = inspect.signature(function)
    rows = [_parameter(p) for p in signature.parameters.values()]
    text = inspect.getdoc(function) or ""
    raised = list(dict.fromkeys(_ERRORS.findall(text)))
    first, _, rest = text.partition("\n\n")
    parts = [
        block(f"{function.__name__}{_short(signature)}", "python"),
        paragraphs(first) + "\n",
        table(("parameter", "type", "default", "meaning"), rows) if rows else "",
        f"**Returns** {_type(signature.return_annotation)}\n",
        f"**Raises** {', '.join(map(_linked_error, raised))}\n" if raised else "",
        paragraphs(rest) + "\n",
    ]
    return "\n".join(part for part in parts if part)


def _short(signature: inspect.Signature) -> str:
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    text = str(inspect.Signature(bare))
    if len(text) < 80:
        return text
    return f"(\n    {fill(text[1:-1], 80, subsequent_indent='    ', break_on_hyphens=False)},\n)"


def _parameter(p: inspect.Parameter) -> list[str]:
    default = "required" if p.default is p.empty else code(repr(p.default))
    return [code(p.name), _type(p.annotation), default, cell(PARAMETERS.get(p.name, ""))]


def _type(annotation: Any) -> str:
    """Return a type as readers know it: Any is a number, an expression or a text with a unit."""
    text = str(annotation).replace("os.PathLike[str]", "Path").replace("npt.ArrayLike", "array").replace(" | ", " or ")
    return code({"Any": "number, text or expression"}.get(text, text))


def _linked_error(name: str) -> str:
    return f"[`{name}`](errors.md#{name.lower()})" if name in mbs.__all__ else code(name)


def _element(cls: type[Element]) -> str:
    where = anchors().get(cls.__name__, "").replace("../", "../../")
    rows = [_field(f) for f in dataclasses.fields(cls)]
    keys = f"The same [keys]({where}) stand in a model file.\n" if where else ""
    return "\n".join([
        block(f"{cls.__name__}{_short(inspect.signature(cls))}", "python"),
        paragraphs(inspect.getdoc(cls)) + "\n",
        table(("parameter", "takes", "default", "meaning"), rows),
        keys + f"\n**Returns** the element, a frozen record. **Raises** {_linked_error('ModelError')}\n",
    ])  # fmt: skip


def _field(f: dataclasses.Field[Any]) -> list[str]:
    default = "required" if f.default is dataclasses.MISSING else code(str(default_of(f) or ""))
    return [code(f.name), cell(kind_of(f.metadata["field"]).words), default, cell(f.metadata["says"])]


_GIVEN: Mapping[str, Mapping[str, Any]] = {
    "Ask": {"value": "u_theta"}, "Baumgarte": {"alpha": 5, "beta": 5}, "Body": {"mass": 2, "com": [0, -1, 0]},
    "Curve": {"y": "x^2"}, "Custom": {"parent": "ground", "child": "arm", "free": [{"rotate": "z"}]},
    "Cylindrical": {"parent": "ground", "child": "arm", "axis": "z"}, "Direct": {"rotate": "z"},
    "Damper": {"damping": 3, "between": ["wall", "cart"]}, "Drag": {"on": "ball", "linear": 0.1},
    "Distributed": {"on": "ball", "between": ["com", "top"], "value": [0, "-3*s", 0]},
    "Frame": {"position": [1, 0, 0]}, "Friction": {"joint": "slide", "static": 0.3, "kinetic": 0.2},
    "GroundMotion": {"x": "0.1*sin(3*t)"}, "Impact": {"impulse": [2, 0, 0], "at": "ball"}, "Initial": {"q": "30 deg"},
    "Limits": {"upper": "90 deg"}, "Motor": {"joint": "hinge", "voltage": 12, "resistance": 1, "constant": 0.05},
    "Potential": {"value": "m*g*y", "on": "ball"}, "Prismatic": {"parent": "ground", "child": "cart", "axis": "x"},
    "Pulley": {"at": "ceiling.hook", "radius": 0.1}, "Settings": {"t_end": "10 s"},
    "Screw": {"parent": "ground", "child": "nut", "axis": "z", "pitch": "5 mm"}, "Surface": {"sphere": 0.1},
    "Shape": {"kind": "rod", "sizes": [1], "mass": 2}, "Stabilisation": {"index_2": True},
    "SpringDamper": {"stiffness": 100, "between": ["wall", "cart"], "damping": 3},
    "Stage": {"at": {"theta": 0}, "release": ["string"]}, "Torque": {"value": 2, "joint": "hinge"},
    "VariableMass": {"value": "m0 - b*t", "relative_velocity": [0, 0, "-c"]},
}  # fmt: skip


def _element_example(cls: type[Element]) -> str:
    given = _GIVEN.get(cls.__name__)
    if given is None:
        needed = [f for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING]
        texts = {f.name: f"{f.name}: {f.metadata['such']}\n" for f in needed}
        given = {name: with_types(read_text(text, "example").data[name]) for name, text in texts.items()}
    written = [repr(x) if name in ("parent", "child") else f"{name}={x!r}" for name, x in given.items()]
    return f"mbs.{cls.__name__}({', '.join(written)})".replace("'", '"')


def _result(cls: type[Any]) -> str:
    rows = list(_members(cls))
    bases = [base for base in cls.__mro__[1:] if base.__name__ in mbs.__all__]
    is_error = bool(bases) and issubclass(cls, Exception)
    kind = f"A kind of {', '.join(_linked_error(base.__name__) for base in bases)}.\n" if is_error else ""
    parts = [paragraphs(inspect.getdoc(cls)) + "\n", kind, table(("member", "type", "meaning"), rows) if rows else ""]
    return "\n".join(part for part in parts if part)


def _members(cls: type[Any]) -> Iterator[tuple[str, str, str]]:
    fields = {f.name: f for f in dataclasses.fields(cls)} if dataclasses.is_dataclass(cls) else {}
    own = {name for c in cls.__mro__ if c.__module__.startswith("multibody_sym.") for name in vars(c)}
    for name in sorted({*fields, *own}):
        if name.startswith("_"):
            continue
        value = inspect.getattr_static(cls, name, None)
        read = getattr(value, "fget", None) or getattr(value, "func", None) or value
        said = inspect.getdoc(read) if callable(read) else ""
        first = paragraphs((said or "").split("\n\n")[0])
        call = f"{name}{_method(cls, name)}" if inspect.isfunction(value) else name
        annotation = fields[name].type if name in fields else getattr(read, "__annotations__", {}).get("return", "")
        yield code(call), _type(annotation) if annotation else "", cell(first)


def _method(cls: type[Any], name: str) -> str:
    signature = inspect.signature(getattr(cls, name))
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values() if p.name != "self"]
    return str(inspect.Signature(bare))
