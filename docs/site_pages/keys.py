"""`docs/keys.md`: every key of a model file, shape, function, quantity and word of state, from the declarations."""

from __future__ import annotations

from multibody_sym.model.bodies import SHAPES
from multibody_sym.model.schema import REPEAT_SAYS
from multibody_sym.model.system import REPEAT_KEY, VERSION_KEY
from site_pages.language import language
from site_pages.markdown import anchor, code, table
from site_pages.model_file import section, sections

ORIGINS = {
    "rod": "at one end; the rod lies along x, its centre of mass at `[length/2, 0, 0]`",
    "disc": "at the centre; the axis is z",
    "ring": "at the centre; the axis is z",
    "cylinder": "at the centre; the axis is z",
    "sphere": "at the centre",
    "shell": "at the centre",
    "box": "at the centre; the edges are along x, y, z",
}
"""Where the body's origin is in each shape."""
_HEAD = f"""\
# Keys, shapes, functions and states

Every key of a model file, every shape with the place of its origin, every function, quantity, unit and word of state.
`PYTHONPATH=docs python -m site_pages` writes this page from the declarations in the code.

- [The file](#system): {{elements}}
- [Shapes](#shapes)
- [Expressions](#expressions): [operators](#operators), [functions](#functions), [quantities](#quantities),
  [states](#states), [units](#units)

A model file is YAML and begins with `{VERSION_KEY}: 1`. Maps are keyed by names that you choose, in any order. Every
number may be an [expression](#expressions) or a number with a unit, such as `45 deg`; plain numbers are SI. Unknown
keys are errors. `multibody-sym schema -o model.schema.json` writes these keys as a JSON Schema, and a first line
`# yaml-language-server: $schema=model.schema.json` lets an editor complete them. `{REPEAT_KEY}`: {REPEAT_SAYS}.

In Python each element is a class of the same name with fields of the same names.
"""


def keys() -> str:
    """Return the page."""
    elements = ", ".join(f"[{title}](#{anchor(title)})" for title, _ in sections())
    parts = [section(title, cls) for title, cls in sections()]
    return "\n".join((_HEAD.format(elements=elements), *parts, _shapes(), language()))


def _shapes() -> str:
    rows = []
    for kind, sizes in SHAPES.items():
        given = sizes[0] if len(sizes) == 1 else f"[{', '.join(sizes)}]"
        rows.append((code(f"{{{kind}: {given}, mass: m}}"), ORIGINS[kind]))
    says = "`shape` of a body gives mass, centre of mass, inertia and a picture."
    return f"## Shapes\n\n{says}\n\n{table(('shape', 'origin of the body'), rows)}"

