"""`new`: examples listed and written, nothing replaced."""

from __future__ import annotations

from pathlib import Path

from command import EXAMPLES, answer, command, here

import multibody_sym as mbs


def test_list_names_every_example_with_its_first_line() -> None:
    examples = answer(here("new", "--list", "--json"))["examples"]
    assert set(examples) == {path.stem for path in EXAMPLES.rglob("*.yaml")}
    assert all(title and not title.startswith(("#", "multibody_sym:")) for title in examples.values())
    assert examples["pendulum"] in here("new", "--list").stdout


def test_an_example_is_written_once(tmp_path: Path) -> None:
    assert answer(here("new", "double_pendulum", "--json", cwd=tmp_path))["file"] == "double_pendulum.yaml"
    assert mbs.load(tmp_path / "double_pendulum.yaml") == mbs.load(EXAMPLES / "double_pendulum.yaml")
    (tmp_path / "double_pendulum.yaml").write_text("mine")
    again = here("new", "double_pendulum", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr
    assert (tmp_path / "double_pendulum.yaml").read_text() == "mine"


def test_a_name_of_one_s_own(tmp_path: Path) -> None:
    assert here("new", "-o", "mine.yaml", cwd=tmp_path).returncode == 0
    assert (tmp_path / "mine.yaml").exists()
    assert here("new", "-o", "no/folder.yaml", cwd=tmp_path).returncode == 4


def test_a_dash_is_no_file_without_a_word(tmp_path: Path) -> None:
    refused = here("new", "-o", "-", cwd=tmp_path)
    assert (refused.returncode, list(tmp_path.iterdir())) == (2, [])
    assert "write /dev/stdout for standard output, ./- for a file" in refused.stderr
    assert here("new", "-o", "./-", cwd=tmp_path).returncode == 0
    assert mbs.loads((tmp_path / "-").read_text()) == mbs.load(EXAMPLES / "pendulum.yaml")
    assert command("new", "-o", "/dev/stdout", cwd=tmp_path).stdout.startswith((EXAMPLES / "pendulum.yaml").read_text())


def test_commands_without_a_model_offer_no_changes_of_one() -> None:
    for name in ("new", "import"):
        described = here(name, "--help").stdout
        assert "--json" in described
        assert all(option not in described for option in ("--set", "--formalism", "--project"))
    refused = here("new", "--set", "m=1")
    assert refused.returncode == 2
    assert "new has no option '--set'" in refused.stderr
