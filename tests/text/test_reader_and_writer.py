"""Model files: what is loaded is what was dumped, and every error says file, line, column and path."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from multibody_sym.errors import InputError
from multibody_sym.mechanics.model_files import dump, dumps, load, loads, yaml_text
from multibody_sym.scalars.node import symbol
from multibody_sym.text.yaml_tree import read_text

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
DATA = sorted((Path(__file__).parent / "data").glob("*.yaml"))

PENDULUM = """multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: {value: 50 cm, positive: true}, g: 9.81}
bodies:
  bob: {mass: m, com: [0, -l, 0]}
joints:
  hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}
outputs:
  x: "position(bob, x)"
"""


@pytest.mark.parametrize("path", EXAMPLES + DATA, ids=lambda p: p.stem)
def test_what_is_dumped_loads_equal(path, tmp_path):
    system = load(path)
    assert loads(dumps(system)) == system
    dump(system, tmp_path / "copy.yaml")
    assert load(tmp_path / "copy.yaml") == system
    assert dumps(load(tmp_path / "copy.yaml")) == dumps(system)


def test_order_in_the_file_does_not_matter_to_the_meaning():
    lines = PENDULUM.splitlines(keepends=True)
    assert loads("".join(lines[:3] + lines[4:] + lines[3:4])) == loads(PENDULUM)


SCALARS = st.one_of(
    st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), min_size=0, max_size=20),
    st.text("-?:,[]{}#&*!|>'\"%@` =~<ab01.", max_size=8),
    st.sampled_from(["---", "...", "- a", "a: b", "a #b", "on", "012", "1e3", "reaction(C, fx)", "a\nb", "\t", "it's"]),
)
KEYS = SCALARS.filter(lambda text: text and "\n" not in text)
TREES = st.dictionaries(
    KEYS,
    st.recursive(SCALARS, lambda b: st.lists(b, max_size=4) | st.dictionaries(KEYS, b, max_size=4), max_leaves=12),
    min_size=1,
    max_size=5,
)


@settings(suppress_health_check=[HealthCheck.too_slow])  # that depends on what else the machine does
@given(TREES)
def test_every_tree_reads_back(tree):
    assert read_text(yaml_text(tree), "f").data == tree


def test_the_text_is_what_people_would_write():
    text = dumps(loads(PENDULUM))
    assert "gravity: [0, -g, 0]\n" in text
    assert "  bob: {mass: m, com: [0, -l, 0]}\n" in text
    assert '{x: "position(bob, x)"}' in text
    assert text.splitlines()[:2] == ["multibody_sym: 1", "name: pendulum"]


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("missing.yaml", "there is no such file"), ("pendulun.yaml", "did you mean"), (".", "directory"),
        ("a\0b", "cannot be read"),
    ],
)
def test_files_that_cannot_be_read(tmp_path, name, part):
    (tmp_path / "pendulum.yaml").write_text(PENDULUM)
    with pytest.raises(InputError) as caught:
        load(os.fspath(tmp_path) + "/" + name)
    assert part in caught.value.message
    assert caught.value.exit_code == 2
    assert caught.value.where.file.startswith(os.fspath(tmp_path))


def test_a_file_without_permission(tmp_path, monkeypatch):
    def refused(*args, **_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("builtins.open", refused)
    with pytest.raises(InputError, match="the file cannot be read: Permission denied"):
        load(tmp_path / "x.yaml")


@pytest.mark.parametrize("name", ["E", "I", "S", "N", "beta", "gamma", "lambda", "on", "yes", "null", "Symbol", "sin"])
def test_names_that_mean_something_elsewhere_are_ordinary_names(name):
    system = loads(PENDULUM.replace("m: 1 kg", f"{name}: 1 kg").replace("mass: m,", f"mass: {name},"))
    assert system.bodies["bob"].mass is symbol(name)
    assert loads(dumps(system)) == system
