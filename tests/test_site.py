"""The documentation has a page for every key, option, error, public name and example; nothing leads nowhere."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path

import pytest
import yaml
from site_pages import commands, gallery, json_objects, language, model_file, pictures
from site_pages.generated import generated
from site_pages.markdown import anchor

import multibody_sym as mbs
from multibody_sym.cli.explained.pages import EXPLAINED
from multibody_sym.cli.main import main
from multibody_sym.expressions.parser import FUNCTIONS
from multibody_sym.expressions.quantities import QUANTITIES
from multibody_sym.model.declaration.fields import Element

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def reference() -> Mapping[str, str]:
    """The text of each generated page, those of examples apart, which take a while."""
    slow = gallery.pages()
    return {address: make() for address, make in generated().items() if address not in slow}


def below(cls: type[Element]) -> set[type[Element]]:
    return {cls}.union(*(below(one) for one in cls.__subclasses__()))


def test_every_key_has_its_line(reference: Mapping[str, str]) -> None:
    page, told = reference["reference/model_file.md"], {cls for _, cls in model_file.sections()}
    for title, cls in model_file.sections():
        part = page.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
        missing = [f.name for f in dataclasses.fields(cls) if f"\n| `{f.name}` | {f.metadata['says'][:20]}" not in part]
        assert missing == [], title
    abstract = {"Element", "Joint", "MovingJoint", "AxialJoint"}
    never_written = {"Foot", "Extreme", "Equation", "Impacts", "Shape"}
    ours = {cls for cls in below(Element) if cls.__module__.startswith("multibody_sym.model")}
    assert {cls.__name__ for cls in ours - told} <= abstract | never_written
    assert set(mbs.schema()["$defs"]) <= {cls.__name__ for cls in told}


def test_every_option_has_its_line(reference: Mapping[str, str]) -> None:
    page = reference["reference/commands.md"]
    for name, parser in commands.parsers().items():
        part = page.partition(f"\n## {name}\n")[2].partition("\n## ")[0]
        options = {option for action in parser._actions for option in action.option_strings} - {"-h", "--help"}
        assert [option for option in options if f"`{option}`" not in part] == [], name
        assert all(action.help for action in parser._actions), name


def test_every_error_name_and_example_has_its_place(reference: Mapping[str, str]) -> None:
    assert [n for n in EXPLAINED if f"\n## {n}: " not in reference["reference/errors.md"]] == []
    assert [n for n in mbs.__all__ if f"\n### {n}\n" not in reference["reference/python_api.md"]] == []
    assert [n for n in gallery.examples() if f"({n}.md)" not in reference["gallery/index.md"]] == []
    files = sorted(ROOT.glob("examples/**/*.yaml"))
    assert sorted(gallery.pages().values()) == files
    assert len(gallery.pages()) == len(files)
    assert [path.stem for path in files if len(gallery.statement(path)) < 20] == []


def test_every_function_and_quantity_is_told() -> None:
    assert set(language.FUNCTIONS_SAY) == set(FUNCTIONS)
    assert set(language.QUANTITIES_SAY) == set(QUANTITIES)
    assert language._factor("rpm") == "0.1047197551"
    assert language._factor("kN") == "1000"


def test_a_page_of_the_gallery_has_all_its_parts() -> None:
    page = gallery.page(ROOT / "examples" / "textbook" / "t7_atwood.yaml")
    assert "g*(m2 - m1)/(m1 + m2)" in page
    assert "<figure><svg" in page
    assert "<?xml" not in page
    for part in ("## The file", "## Equations", "## What holds at the start", "## Check against theory"):
        assert part in page
    assert len(gallery.theories()) > 40


def test_pictures_are_drawn_of_what_stands_in_the_page() -> None:
    drawn = {address: make() for address, make in pictures.pictures().items()}
    assert all(svg.lstrip().startswith("<?xml") and "<svg" in svg for svg in drawn.values())
    assert "block" in drawn["tutorials/incline.svg"]
    assert "rod" in drawn["tutorials/slider_crank.svg"]


def test_links_lead_somewhere(reference: Mapping[str, str]) -> None:
    written = {path.relative_to(DOCS).as_posix(): path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
    texts = {**written, **reference}
    known = {*texts, *gallery.pages(), *pictures.pictures()}
    for address, text in texts.items():
        prose = re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)\s]+)\)", prose):
            if target.startswith("http"):
                continue
            file, _, place = target.partition("#")
            whole = (Path(address).parent / file).as_posix() if file else address
            resolved = Path(*[part for part in Path(whole).parts if part != "."])
            if (DOCS / whole).resolve().is_relative_to(ROOT / "examples"):  # the site leads to its gallery instead
                assert (DOCS / whole).exists(), f"{address}: {target}"
                continue
            name = "/".join(_without_dots(resolved.parts))
            assert name in known or (DOCS / name).exists(), f"{address}: {target}"
            if place:
                assert place in {anchor(head) for head in re.findall(r"^#+ (.*)$", texts[name], re.MULTILINE)}, target


def _without_dots(parts: tuple[str, ...]) -> list[str]:
    found: list[str] = []
    for part in parts:
        if part == "..":
            found.pop()
        else:
            found.append(part)
    return found


def test_the_menu_leads_to_pages() -> None:
    menu = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    pages = set(generated()) | {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")}
    listed = re.findall(r"'([\w/]+\.md)'", str(menu))
    assert len(listed) > 10
    assert set(listed) <= pages


JSON = {
    "check": ("examples/four_bar.yaml",),
    "derive": ("examples/pendulum.yaml", "--theorems"),
    "solve": ("examples/textbook/t5_incline.yaml",),
    "equilibrium": ("examples/pendulum.yaml",),
    "linearize": ("examples/pendulum.yaml",),
    "modes": ("examples/pendulum.yaml",),
    "simulate": ("examples/pendulum.yaml", "--t-end", "0.05", "--backend", "python", "--verify"),
    "sweep": ("examples/pendulum.yaml", "--vary", "m=1,2", "--t-end", "0.05", "--backend", "python"),
    "new": ("--list",),
    "explain": ("M101",),
}


@pytest.mark.parametrize("command", JSON)
def test_every_key_of_json_objects_is_told(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    file, *options = JSON[command]
    place = str(ROOT / file) if file.endswith(".yaml") else file
    assert main([command, place, *options, "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) - set(json_objects.OBJECTS[command]) == set()


def test_every_command_is_told_in_json_objects() -> None:
    assert set(commands.parsers()) - set(json_objects.OBJECTS) == {"schema"}


class _Asked(HTMLParser):
    """What a page asks the network for."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        loading = {"link": "href", "script": "src", "img": "src", "iframe": "src"}
        for name, value in attrs:
            if loading.get(tag) == name and value and re.match(r"(https?:)?//", value):
                self.asked.append(value)


@pytest.mark.long
def test_the_site_is_built_by_one_command_and_asks_for_nothing(tmp_path: Path) -> None:
    import subprocess
    import sys

    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(tmp_path / "site")]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > len(gallery.pages())
    for page in pages:
        parser = _Asked()
        parser.feed(page.read_text(encoding="utf-8"))
        assert parser.asked == [], page
