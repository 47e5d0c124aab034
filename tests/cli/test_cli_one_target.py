"""`simulate -o` where another run writes the same file, where it is a pipe or the model, and where names are taken."""

from __future__ import annotations

import json
import os
import stat
import threading
from pathlib import Path

import pytest
from command import EXAMPLES

from multibody_sym.cli import runs as recording_module
from multibody_sym.cli.main import main
from multibody_sym.motion.simulate import Prepared
from multibody_sym.text.tables import read_table

RUN = ("simulate", str(EXAMPLES / "pendulum.yaml"), "--t-end", "0.1", "--samples", "11", "--backend", "python")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def after_the_run(monkeypatch: pytest.MonkeyPatch, happens: object) -> None:
    """Let something happen to the files between the last step of a run and its end."""
    run = Prepared.run

    def simulated(*arguments: object, **options: object) -> object:
        done = run(*arguments, **options)  # type: ignore[arg-type]
        happens()  # type: ignore[operator]
        return done

    monkeypatch.setattr(Prepared, "run", simulated)


def test_who_loses_is_told_on_standard_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    after_the_run(monkeypatch, lambda: Path("out.csv").write_bytes(b"another run's"))
    assert main([*RUN, "-o", "out.csv"]) == 4
    printed = capsys.readouterr()
    assert printed.err == "out.csv is another run's: it was written while this one lasted\n"
    assert "wrote out.2.csv" in printed.out
    assert "another run's" not in printed.out


@pytest.mark.parametrize("name", ["out.csv", "out.npz"])
@pytest.mark.parametrize("before", [None, b"older"])
def test_who_loses_is_told_and_keeps_the_table(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str, before: bytes | None
) -> None:
    if before is not None:
        Path(name).write_bytes(before)
    after_the_run(monkeypatch, lambda: Path(name).write_bytes(b"another run's"))
    assert main([*RUN, "-o", name, "--json"]) == 4
    printed = capsys.readouterr()
    own = name.replace("out", "out.2")
    assert json.loads(printed.out)["written"] == [own]
    assert f"wrote {own}" in printed.err
    assert f"{name} is another run's" in printed.err
    assert f"wrote {name}" not in printed.err
    assert Path(name).read_bytes() == b"another run's"
    assert len(read_table(own)) == 11
    assert sorted(os.listdir()) == sorted([name, own])


def test_a_pipe_is_written_through(capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo("out.csv")
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(Path("out.csv").read_bytes()), daemon=True)
    reader.start()
    assert main([*RUN, "-o", "out.csv"]) == 0
    reader.join(10)
    assert read[0].count(b"\n") == 12
    assert stat.S_ISFIFO(os.stat("out.csv").st_mode)
    assert os.listdir() == ["out.csv"]
    assert "wrote out.csv" in capsys.readouterr().out


def test_a_table_that_grows_beside_another_format_harms_no_csv(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_module, "_LONG", 0.0)
    Path("out.npz.csv").write_text("the user's own")
    after_the_run(monkeypatch, lambda: seen.append(sorted(os.listdir())))
    seen: list[list[str]] = []
    assert main([*RUN, "-o", "out.npz"]) == 0
    assert seen == [["out.npz.csv", "out.npz.csv.partial"]]
    assert sorted(os.listdir()) == ["out.npz", "out.npz.csv"]
    assert Path("out.npz.csv").read_text() == "the user's own"
    assert len(read_table("out.npz")) == 11


@pytest.mark.parametrize(
    ("model", "options"),
    [
        ("run.csv", ["-o", "run.csv"]),
        ("run.csv", ["-o", "./run.csv"]),
        ("run.csv", ["-o", "link.csv"]),
        ("run.png", ["--plot"]),
        ("run.svg", ["-o", "out.csv", "--plot", "run.svg"]),
    ],
)
def test_the_model_is_never_replaced_by_its_results(
    capsys: pytest.CaptureFixture[str], model: str, options: list[str]
) -> None:
    text = (EXAMPLES / "pendulum.yaml").read_text()
    Path(model).write_text(text)
    Path("link.csv").symlink_to("run.csv")
    assert main(["simulate", model, *RUN[2:], *options, "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert "the model itself" in error["message"]
    assert error["where"]["file"] == (options[-1] if options != ["--plot"] else model)
    assert Path(model).read_text() == text
    assert sorted(os.listdir()) == ["link.csv", model]
