"""A page for every example: statement, figure, file, equations, answers, and the theory where the example tells it."""

from __future__ import annotations

import re
from pathlib import Path

import multibody_sym as mbs
from site_pages.markdown import block, cell, code, plain, table

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
_LONGEST = 60
_BUDGET = 60.0
_TITLES = {
    "": "Mechanisms",
    "textbook": "Textbook problems with friction, contacts and ropes",
    "questions": "Questions and answers",
    "impacts": "Impacts",
    "feet": "Walking, landing, toppling",
    "oscillations": "Small oscillations",
    "states": "Pressures, currents, controllers",
    "guides": "Curves that guide",
    "variable_mass": "Masses that vary",
}


def examples() -> dict[str, Path]:
    """Return the model file of each example by name."""
    return {path.stem: path for path in sorted(EXAMPLES.rglob("*.yaml"))}


def pages() -> dict[str, Path]:
    """Return the address of each example's page, with its file."""
    return {f"gallery/{name}.md": path for name, path in examples().items()}


def overview() -> str:
    """Return the page that leads to all of them."""
    groups: dict[str, list[Path]] = {}
    for path in examples().values():
        groups.setdefault(path.parent.name if path.parent != EXAMPLES else "", []).append(path)
    parts = ["# Gallery\n\n`multibody-sym new NAME` writes any of these files.\n"]
    for group, paths in groups.items():
        rows = [(f"[{path.stem}]({path.stem}.md)", cell(plain(statement(path)))) for path in paths]
        parts.append(f"## {_TITLES.get(group, group)}\n\n{table(('example', 'statement'), rows)}")
    return "\n".join(parts)


def page(path: Path) -> str:
    """Return the page of one example: figure, statement, file, equations, answers."""
    system = mbs.load(path)
    parts = [f"# {path.stem.replace('_', ' ')}\n", plain(statement(path)) + "\n", figure(system)]
    theory = theories().get(path.stem)
    parts.append(f"## The file\n\n{block(path.read_text(encoding='utf-8'), 'yaml')}")
    parts.append(f"## Equations\n\n{_equations(system)}")
    parts.append(f"## What holds at the start\n\n{_answers(system)}")
    if theory:
        parts.append(f"## Check against theory\n\n{theory}\n\nA test compares the numbers with it.\n")
    return "\n".join(parts)


def statement(path: Path) -> str:
    """Return what an example is about: its `description`."""
    return str(mbs.load(path).description)


def figure(system: mbs.System) -> str:
    """Return the figure of a system as SVG within the page; the empty text where there is none."""
    draw = getattr(mbs, "draw", None)
    if draw is None:
        return ""
    try:
        return f"<figure>{inline(draw(system).svg)}</figure>\n"
    except mbs.MultibodyError as error:
        return f"There is no figure: {plain(str(error).splitlines()[0])}\n"


def inline(svg: str) -> str:
    """Return a picture as one line of a page: a blank line would end it, and a page has no second XML declaration."""
    return " ".join(re.sub(r"<\?xml.*?\?>", "", svg).split("\n")).strip()


def theories() -> dict[str, str]:
    """Return the formula of theory by example, where the tables of the examples have one."""
    found = {}
    for readme in EXAMPLES.rglob("README.md"):
        for name, _, formula in re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \|$", readme.read_text(), re.MULTILINE):
            found[name] = formula
    return found


def _equations(system: mbs.System) -> str:
    from multibody_sym.documents.derivation import derivation_document
    from multibody_sym.documents.document import write_document

    try:
        return _shortened(write_document(derivation_document(mbs.derive(system, budget=_BUDGET)), "text"))
    except mbs.MultibodyError as error:
        return f"They are not written out: {plain(str(error).splitlines()[0])}\n"


def _answers(system: mbs.System) -> str:
    from multibody_sym.documents.solution import solution_text
    from multibody_sym.text.values import chosen_units

    try:
        return _shortened(solution_text(mbs.solve(system), chosen_units(None)))
    except mbs.MultibodyError as error:
        return f"{plain(str(error).splitlines()[0])}\n"


def _shortened(text: str) -> str:
    lines = [line if len(line) <= 400 else f"{line[:400]} .." for line in text.splitlines()]
    more = len(lines) - _LONGEST
    told = f"\n({more} more lines: {code('multibody-sym derive')}, {code('solve')})\n" if more > 0 else ""
    return block("\n".join(lines[:_LONGEST])) + told
