"""The documentation has a page for every key, option, error, public name and example; nothing leads nowhere."""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import re
import shutil
import warnings
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image, ImageSequence
from site_pages import commands, gallery, json_objects, keys, language, model_file, python_api, written
from site_pages.generated import generated
from site_pages.markdown import anchor, plain

import multibody_sym as mbs
from multibody_sym.cli.error_pages import EXPLAINED
from multibody_sym.cli.main import main
from multibody_sym.model.bodies import SHAPES
from multibody_sym.model.fields import Element, key_of
from multibody_sym.model.state_words import VERBS
from multibody_sym.text.parser import FUNCTIONS, QUANTITIES

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def reference() -> Mapping[str, str]:
    """The text of each generated page, those of examples apart, which take a while."""
    return {address: make() for address, make in generated().items()}


def below(cls: type[Element]) -> set[type[Element]]:
    return {cls}.union(*(below(one) for one in cls.__subclasses__()))


def test_every_key_has_its_line() -> None:
    page, told = (DOCS / "keys.md").read_text(encoding="utf-8"), {cls for _, cls in model_file.sections()}
    for title, cls in model_file.sections():
        part = page.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
        lines = {f.name: f"\n| `{key_of(f.name)}` | {f.metadata['says'][:20]}" for f in dataclasses.fields(cls)}
        missing = [name for name, line in lines.items() if line not in part]
        assert missing == [], title
    abstract = {"Element", "Joint", "MovingJoint", "AxialJoint", "Tabled"}
    never_written = {"Foot", "Extreme", "Tendency", "Equation", "Impacts", "Shape"}
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
    python = "".join(text for address, text in reference.items() if address.startswith("reference/python/"))
    assert [n for n in mbs.__all__ if not re.search(rf"\n###? {re.escape(plain(n))}\n", python)] == []
    pictures = [n for n in gallery.examples() if f'href="{n}.html"><img src="{n}.svg"' in reference["gallery/index.md"]]
    assert pictures == list(gallery.examples())
    files = sorted(ROOT.glob("examples/**/*.yaml"))
    assert sorted(gallery.pages().values()) == files
    assert len(gallery.pages()) == len(files)
    assert [path.stem for path in files if len(gallery.statement(path)) < 20] == []


def test_what_code_writes_is_that_of_the_code() -> None:
    old = [path.name for path, make in written.written().items() if path.read_text(encoding="utf-8") != make()]
    assert old == [], "PYTHONPATH=docs python -m site_pages writes them anew"


@pytest.mark.long
def test_the_moving_picture_is_that_of_the_code(tmp_path: Path) -> None:
    (tmp_path / "new.gif").write_bytes(written.moving_picture())
    with Image.open(written.MOVING) as old, Image.open(tmp_path / "new.gif") as new:
        assert (old.size, old.n_frames) == (new.size, new.n_frames)
        for a, b in zip(ImageSequence.Iterator(old), ImageSequence.Iterator(new), strict=True):
            differs = np.any(np.asarray(a.convert("RGB")) != np.asarray(b.convert("RGB")), axis=2)
            assert differs.mean() < 0.01


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that examples of the Python reference read."""
    found = tmp_path_factory.mktemp("examples")
    for name in ("pendulum", "cart_pole", "t5_incline"):
        shutil.copy(gallery.examples()[name], found)
    return found


@pytest.mark.parametrize("name", sorted(set(mbs.__all__) - set(python_api.MATHEMATICS)))
def test_examples_of_the_python_reference_run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    with warnings.catch_warnings():
        exec(compile(python_api.example(name), name, "exec"), {"mbs": mbs, "__name__": "__main__"})


def test_parameters_have_a_type_a_meaning_and_a_return(reference: Mapping[str, str]) -> None:
    python = "".join(text for address, text in reference.items() if address.startswith("reference/python/"))
    for name in mbs.__all__:
        value = getattr(mbs, name)
        if not inspect.isfunction(value) or name in python_api.MATHEMATICS:
            continue
        part = re.split(r"\n## ", python.partition(f"\n## {plain(name)}\n")[2])[0]
        assert "**Returns** `" in part, name
        assert all(f"\n| `{parameter}` | `" in part for parameter in inspect.signature(value).parameters), name
    functions = [getattr(mbs, name) for name in mbs.__all__ if inspect.isfunction(getattr(mbs, name))]
    known = {parameter for function in functions for parameter in inspect.signature(function).parameters}
    assert set(python_api.PARAMETERS) ^ known == set(), "docs/site_pages/python_words.py says what each parameter means"


def test_the_origin_of_every_shape_is_where_its_mass_says() -> None:
    """A rod's centre of mass is half a length along x from the origin, all others' at the origin."""
    assert set(keys.ORIGINS) == set(SHAPES)
    for kind, sizes in SHAPES.items():
        shape = {kind: list(range(2, 2 + len(sizes))), "mass": 1}
        system = mbs.System(kind, bodies={"b": mbs.Body(shape=shape)}, joints={"j": mbs.Free("ground", "b")})
        (body,) = mbs.mechanism(system).bodies
        com = [float(x.shadow or 0.0) for x in body.mass.com]
        assert com == ([1.0, 0.0, 0.0] if kind == "rod" else [0.0, 0.0, 0.0])
        assert keys.ORIGINS[kind].startswith("at one end" if kind == "rod" else "at the centre")


def test_every_function_and_quantity_is_told() -> None:
    assert set(language.FUNCTIONS_SAY) == set(FUNCTIONS)
    assert set(language.QUANTITIES_SAY) == set(QUANTITIES)
    text = (DOCS / "keys.md").read_text(encoding="utf-8")
    assert [name for name in (*FUNCTIONS, *QUANTITIES) if f"`{name}(" not in text and f"{name}`" not in text] == []
    assert [verb for verb in VERBS if f"`NAME {verb}`" not in text] == []
    assert language._factor("rpm") == "0.1047197551"
    assert language._factor("kN") == "1000"


def test_a_page_of_the_gallery_has_all_its_parts() -> None:
    made = gallery.make(ROOT / "examples" / "textbook" / "t7_atwood.yaml")
    page = made.markdown
    assert "g*(m2 - m1)/(m1 + m2)" in page
    assert "](t7_atwood.svg)" in page
    assert 'src="t7_atwood_motion.html"' in page
    assert made.figure.lstrip().startswith("<?xml")
    assert made.film.startswith("<!DOCTYPE html>")
    assert page.count("<math") > 10
    for part in ("## Motion", "## Model file", "## Answers at the start", "## Equations of motion", "## Theory"):
        assert part in page
    assert len(gallery.theories()) > 40


def test_pictures_are_drawn_of_what_stands_in_the_page() -> None:
    drawn = {path.name: path.read_text(encoding="utf-8") for path in written.written() if path.suffix == ".svg"}
    assert all(svg.lstrip().startswith("<?xml") and "<svg" in svg for svg in drawn.values())
    assert "block" in drawn["incline.svg"]
    assert "rod" in drawn["slider_crank.svg"]


WRITTEN = [ROOT / "README.md", ROOT / "CHANGES.md", *sorted(DOCS.rglob("*.md")), *sorted(ROOT.glob("examples/**/*.md"))]


def links(text: str) -> list[str]:
    """Return the targets of links and pictures, less those in code and in the network."""
    prose = re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)
    found = re.findall(r"\]\(([^)\s]+)\)", prose)
    return [target for target in found if not target.startswith("http")]


def headings(text: str) -> set[str]:
    return {anchor(head) for head in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere_in_a_checkout(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for target in links(text):
        file, _, place = target.partition("#")
        goal = path.parent / file if file else path
        assert goal.exists(), target
        assert not place or place in headings(goal.read_text(encoding="utf-8")), target


def test_links_of_generated_pages_lead_somewhere(reference: Mapping[str, str]) -> None:
    known = {*reference, *gallery.pages()}
    for address, text in reference.items():
        for target in links(text):
            file, _, place = target.partition("#")
            goal = os.path.normpath(Path(address).parent / file) if file else address
            assert goal in known or (DOCS / goal).exists(), f"{address}: {target}"
            other = reference.get(goal) or ((DOCS / goal).read_text("utf-8") if (DOCS / goal).exists() else "")
            assert not place or place in headings(other), f"{address}: {target}"


@pytest.mark.parametrize("path", sorted((DOCS / "guide").glob("*.md")), ids=lambda path: path.stem)
def test_a_guide_has_headings(path: Path) -> None:
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    sections = re.split(r"^## ", text, flags=re.MULTILINE)
    assert len(sections) > 1
    assert sections[0].count("\n") < 20, "the text before the first heading is long"


def test_readme_and_first_page_install_alike() -> None:
    line = re.compile(r"^python3 -m venv .*simulate.*$", re.MULTILINE)
    pages = [(ROOT / "README.md").read_text("utf-8"), (DOCS / "index.md").read_text("utf-8")]
    assert line.findall(pages[0]) == line.findall(pages[1]) != []
    tutorials = [path.read_text("utf-8") for path in sorted((DOCS / "tutorials").glob("*.md"))]
    assert all("](../index.md#install)" in text and "pip install 'multibody" not in text for text in tutorials)


def test_the_first_page_has_a_model_of_twelve_lines_and_what_a_newcomer_asks() -> None:
    page = (DOCS / "index.md").read_text("utf-8")
    assert len(written.printed(DOCS / "index.md", "yaml").splitlines()) == 12
    heads = re.findall(r"^## (.*)$", page, re.MULTILINE)
    assert heads == ["Install", "Who it is for", "Compared with other tools", "When not to use it", "Next"]
    assert "](double_pendulum.gif)" in page


def test_every_code_block_has_a_language(reference: Mapping[str, str]) -> None:
    texts = {path.name: path.read_text("utf-8") for path in WRITTEN} | dict(reference)
    for name, text in texts.items():
        opening = re.findall(r"^(?:```|~~~~)(.*)$", text, re.MULTILINE)[::2]
        assert all(opening), name


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
    text = {page: page.read_text(encoding="utf-8") for page in pages}
    plain_blocks = [p for p, t in text.items() if re.search(r"<pre><code>", t) and not p.name.endswith("_motion.html")]
    assert plain_blocks == []
    assert '<span class="nt">' in text[tmp_path / "site" / "guide" / "first_model.html"]
    assert "<math" in text[tmp_path / "site" / "index.html"]
    assert all((tmp_path / "site" / "gallery" / f"{name}.svg").exists() for name in gallery.examples())
    assert len(pages) > len(gallery.pages())
    for page in pages:
        parser = _Asked()
        parser.feed(text[page])
        assert parser.asked == [], page
