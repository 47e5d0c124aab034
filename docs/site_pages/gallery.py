"""A page for every example: statement, figure, film, file, answers, steps, equations, and the theory that it meets.

A page takes up to some seconds, so it is kept in `build/site_cache` until the example or any code changes.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict, dataclass, replace
from functools import cache
from html import escape
from pathlib import Path

import multibody_sym as mbs
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import Document, HtmlWriter, worked_document
from multibody_sym.documents.solution import solution_text
from multibody_sym.text.values import chosen_units
from site_pages.markdown import block, plain

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
CACHE = ROOT / "build" / "site_cache"
_LONGEST = 60
_BUDGET = 60.0
_TITLES = {
    "": "Mechanisms",
    "textbook": "Textbook problems with friction, contacts and ropes",
    "questions": "Questions and answers",
    "impacts": "Impacts",
    "stages": "Several stages in one file",
    "feet": "Walking, landing, toppling",
    "oscillations": "Small oscillations",
    "states": "Pressures, currents, controllers",
    "guides": "Curves that guide",
    "variable_mass": "Masses that vary",
}
_NUMBERED = re.compile(r"^t\d+\w?_")
"""Textbook problems have a number before their names."""


@dataclass(frozen=True)
class ExamplePage:
    """The page of an example in Markdown, with the files beside it: its figure (SVG) and its film (HTML)."""

    markdown: str
    figure: str
    film: str


def examples() -> dict[str, Path]:
    """Return the model file of each example by name."""
    return {path.stem: path for path in sorted(EXAMPLES.rglob("*.yaml"))}


def pages() -> dict[str, Path]:
    """Return the address of each example's page, with its file."""
    return {f"gallery/{name}.md": path for name, path in examples().items()}


def title(name: str) -> str:
    """Return the name of an example as words."""
    words = _NUMBERED.sub("", name).replace("_", " ")
    return words[:1].upper() + words[1:]


def overview() -> str:
    """Return the page that shows all figures by topic."""
    groups: dict[str, list[Path]] = {}
    for path in examples().values():
        groups.setdefault(path.parent.name if path.parent != EXAMPLES else "", []).append(path)
    head = "Each picture leads to a model, its motion, answers and equations. `multibody-sym new NAME` writes its file."
    parts = [f"# Gallery\n\n{head}\n"]
    for group, paths in groups.items():
        cards = "\n".join(map(_card, paths))
        parts.append(f'## {_TITLES.get(group, group)}\n\n<div class="cards">\n{cards}\n</div>\n')
    return "\n".join(parts)


def _card(path: Path) -> str:
    name, words = path.stem, escape(statement(path).partition(". ")[0].rstrip("."))
    image = f'<img src="{name}.svg" alt="Figure of {escape(title(name))}" loading="lazy">'
    return f'<a href="{name}.html">{image}<strong>{escape(title(name))}</strong><span>{words}.</span></a>'


def example_page(path: Path) -> ExamplePage:
    """Return the page of an example, from the cache where neither it nor any code has changed."""
    digest = hashlib.sha256(path.read_bytes() + _digest_of_code()).hexdigest()[:16]
    kept = CACHE / f"{path.stem}-{digest}.json"
    if kept.exists():
        return ExamplePage(**json.loads(kept.read_text(encoding="utf-8")))
    made = make(path)
    CACHE.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(asdict(made)), encoding="utf-8")
    return made


@cache
def _digest_of_code() -> bytes:
    package = [path for folder in ("multibody_sym", "templates") for path in (ROOT / folder).rglob("*.*")]
    files = [Path(__file__), *EXAMPLES.rglob("README.md"), *package]
    digest = hashlib.sha256()
    for file in sorted(path for path in files if path.is_file() and path.suffix != ".pyc"):
        digest.update(file.read_bytes())
    return digest.digest()


def make(path: Path) -> ExamplePage:
    """Return the page of an example."""
    name, system = path.stem, mbs.load(path)
    figure, film = _figure(system), _film(system)
    parts = [f"# {title(name)}\n", plain(statement(path)) + "\n"]
    if figure:
        parts.append(f"![Figure of {plain(title(name))}]({name}.svg)\n{{ .figure }}\n")
    parts.append(f"`multibody-sym new {name}` writes this model to `{name}.yaml`.\n")
    if film:
        frame = f'<iframe class="film" src="{name}_motion.html" title="Motion of {escape(title(name))}" loading="lazy">'
        parts.append(f"## Motion\n\n{frame}</iframe>\n")
    parts.append(f"## Model file\n\n{block(path.read_text(encoding='utf-8'), 'yaml')}")
    parts.append(f"## Answers at the start\n\n{_answers(system)}")
    parts.append(f"## Equations of motion\n\n{_equations(system)}")
    theory = theories().get(name)
    if theory:
        parts.append(f"## Theory\n\n{theory}\n\nA test compares the computed values with this theory.\n")
    return ExamplePage("\n".join(parts), figure, film)


def statement(path: Path) -> str:
    """Return the `description` of an example."""
    return str(mbs.load(path).description)


def _figure(system: mbs.System) -> str:
    try:
        return mbs.draw(system).svg
    except mbs.MultibodyError:
        return ""


def _film(system: mbs.System) -> str:
    """Return the page that plays the motion; the empty text where there is no motion to show."""
    try:
        run = mbs.simulate(system)
    except mbs.RunError as error:
        run = error.trajectory
    except mbs.MultibodyError:
        return ""
    if run is None or len(run) < 2:
        return ""
    return mbs.animate(run).html


def theories() -> dict[str, str]:
    """Return the formula of theory by example, where the tables of the examples have one."""
    found = {}
    for readme in EXAMPLES.rglob("README.md"):
        for name, _, formula in re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \|$", readme.read_text(), re.MULTILINE):
            found[name] = formula
    return found


def typeset(document: Document) -> str:
    """Return a document as HTML within a page of Markdown, formulas in MathML."""
    lines = HtmlWriter(document.notation, level=3).body(document).splitlines()
    body = "\n".join(line for line in lines if line.strip())
    return f'<div class="formulas">\n{body}\n</div>\n'


def typeset_equations(model: str) -> str:
    """Return the equations of motion of a model file's text as HTML, without energies."""
    document = derivation_document(mbs.derive(mbs.loads(model)))
    rows = [section for section in document.sections if section.title == "Equations of motion"]
    return typeset(replace(document, sections=tuple(replace(section, title="") for section in rows)))


def _equations(system: mbs.System) -> str:
    try:
        document = derivation_document(mbs.derive(system, budget=_BUDGET))
    except mbs.MultibodyError as error:
        return f"There is no closed form: {plain(str(error).splitlines()[0])}\n"
    return typeset(document)


def _answers(system: mbs.System) -> str:
    try:
        solution = mbs.solve(system, steps=True)
        answers = _shortened(solution_text(solution, chosen_units(None)))
    except mbs.MultibodyError as error:
        return f"{plain(str(error).splitlines()[0])}\n"
    if solution.steps is None:
        return answers
    steps = typeset(worked_document(solution.steps))
    return f"{answers}\n<details><summary>Solution step by step</summary>\n{steps}</details>\n"


def _shortened(text: str) -> str:
    lines = [line if len(line) <= 400 else f"{line[:400]} .." for line in text.splitlines()]
    more = len(lines) - _LONGEST
    rest = f"\n`multibody-sym solve` prints {more} more lines.\n" if more > 0 else ""
    return block("\n".join(lines[:_LONGEST]), "text") + rest
