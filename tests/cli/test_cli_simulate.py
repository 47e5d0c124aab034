"""`simulate` as users run it: files, interruptions, broken outputs, and the folder it is run in."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from command import EXAMPLES, LONG, PENDULUM, ROOT, answer, command, environment, here

from multibody_sym.errors import OutputError
from multibody_sym.text.tables import read_table


def test_json_is_the_documented_object(tmp_path: Path) -> None:
    done = here("simulate", PENDULUM, "--json", "--t-end", "1", "--samples", "11", "-o", str(tmp_path / "a.csv"))
    printed = answer(done)
    assert done.returncode == 0
    assert "wrote" in done.stderr
    assert len(printed["t"]) == len(printed["coordinates"]["theta"]) == len(printed["speeds"]["u_theta"]) == 11
    assert set(printed["outputs"]) == {"height", "energy", "pull"}
    assert printed["events"] == []
    assert printed["final"]["t"] == 1.0
    assert printed["final"]["coordinates"]["theta"] == printed["coordinates"]["theta"][-1]
    assert set(printed["drift"]) == {"position", "velocity", "energy", "quaternion"}
    assert printed["statistics"]["steps"] > 1
    assert printed["statistics"]["evaluations"] > printed["statistics"]["steps"]
    assert printed["interrupted"] is False


def test_text_names_the_end_and_the_energy() -> None:
    done = here("simulate", PENDULUM, "--t-end", "1")
    assert done.returncode == 0
    for piece in ("pendulum: done at t = 1 s", "dormand_prince", "theta", "rad/s", "total energy -4.905 J"):
        assert piece in done.stdout


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet"])
def test_tables_hold_the_motion(tmp_path: Path, ending: str) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    file = tmp_path / f"motion.{ending}"
    assert here("simulate", PENDULUM, "--samples", "101", "-o", str(file)).returncode == 0
    table = read_table(file)
    assert list(table.columns) == ["t", "theta", "u_theta", "height", "energy", "pull"]
    assert len(table) == 101
    assert np.allclose(table.columns["height"], -np.cos(table.columns["theta"]), rtol=0, atol=1e-14)
    assert os.listdir(tmp_path) == [file.name]


def test_set_moves_the_start(tmp_path: Path) -> None:
    model = tmp_path / "m.yaml"
    text = Path(PENDULUM).read_text().replace("q: 60 deg", "q: l/d").replace("parameters:\n", "parameters:\n  d: 2 m\n")
    model.write_text(text)
    printed = answer(here("simulate", str(model), "--set", "l=2 m", "--set", "m=300 g", "--json"))
    assert printed["coordinates"]["theta"][0] == 1.0
    assert printed["outputs"]["energy"][0] == pytest.approx(-0.3 * 9.81 * 2 * np.cos(1.0))


def test_without_a_compiler_the_same_motion_runs_in_python(tmp_path: Path) -> None:
    words = ("simulate", PENDULUM, "--json", "--t-end", "1")
    usual = answer(command(*words))
    done = command(*words, env=environment(CC="/bin/false", XDG_CACHE_HOME=str(tmp_path)))
    assert done.returncode == 0
    assert done.stderr.count("note: ") == 1
    assert answer(done)["statistics"]["backend"] == "python"
    assert np.allclose(answer(done)["coordinates"]["theta"], usual["coordinates"]["theta"], rtol=0, atol=1e-13)
    assert command(*words, "--backend", "c", env=environment(CC="/bin/false")).returncode == 4


@contextmanager
def started(*words: str, cwd: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a command, which does not outlast its test."""
    with subprocess.Popen(
        [sys.executable, "-m", "multibody_sym", *words],
        cwd=cwd, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for(file: Path, size: int) -> None:
    deadline = time.monotonic() + 60
    while not (file.exists() and file.stat().st_size > size):
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize("as_json", [False, True])
def test_ctrl_c_keeps_the_rows(tmp_path: Path, as_json: bool) -> None:
    given = ("simulate", PENDULUM, *LONG, "-o", "out.csv", *(["--json"] if as_json else []))
    with started(*given, cwd=tmp_path) as process:
        wait_for(tmp_path / "out.csv.partial", 10_000)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    table = read_table(tmp_path / "out.csv")
    assert 100 < len(table) < 2_000_001
    assert np.allclose(np.diff(table.columns["t"]), 0.5)
    assert os.listdir(tmp_path) == ["out.csv"]
    if as_json:
        assert '"interrupted": true' in out
    else:
        assert "interrupted at t" in out


def test_ctrl_c_keeps_the_rows_of_a_table_that_does_not_grow(tmp_path: Path) -> None:
    with started("simulate", PENDULUM, *LONG, "-o", "out.npz", cwd=tmp_path) as process:
        wait_for(tmp_path / "out.npz.csv.partial", 10_000)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 130
    assert len(read_table(tmp_path / "out.npz")) > 100
    assert os.listdir(tmp_path) == ["out.npz"]


def test_kill_leaves_a_readable_file_and_the_old_result(tmp_path: Path) -> None:
    (tmp_path / "out.csv").write_text("t\n1.0\n")
    with started("simulate", PENDULUM, *LONG, "-o", "out.csv", cwd=tmp_path) as process:
        wait_for(tmp_path / "out.csv.partial", 100_000)
        process.kill()
        process.communicate(timeout=60)
    assert len(read_table(tmp_path / "out.csv.partial")) > 100
    assert (tmp_path / "out.csv").read_text() == "t\n1.0\n"


def test_a_failed_run_keeps_its_rows_beside_the_old_result(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "{multibody_sym: 1, name: m, bodies: {b: {mass: 1}},"
        " joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x}},"
        " forces: {f: {type: torque, joint: j, value: log(1 - t)}}}"
    )
    (tmp_path / "out.csv").write_text("t\n1.0\n")
    done = command("simulate", "m.yaml", "-o", "out.csv", "--json", cwd=tmp_path)
    assert done.returncode == 3
    assert "out.csv.partial" in answer(done)["error"]["message"]
    assert 10 < len(read_table(tmp_path / "out.csv.partial")) < 1001
    assert (tmp_path / "out.csv").read_text() == "t\n1.0\n"


def test_a_full_disk_is_an_output_error() -> None:
    with open("/dev/full", "w") as full:
        done = command("simulate", PENDULUM, "--json", capture_output=False, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 4
    assert "cannot be written" in done.stderr


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_a_disk_that_fills_up_leaves_the_old_result(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"out.{ending}"
    assert command("simulate", PENDULUM, "-o", str(file)).returncode == 0
    old = file.read_bytes()

    def little_room() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    done = command("simulate", PENDULUM, "-o", str(file), "--json", "--samples", "5001", preexec_fn=little_room)
    assert done.returncode == 4
    assert "cannot be written" in answer(done)["error"]["message"]
    assert file.read_bytes() == old


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_a_folder_that_takes_no_file_is_an_output_error(ending: str) -> None:
    done = here("simulate", PENDULUM, "-o", f"/proc/out.{ending}", "--json")
    assert done.returncode == 4
    assert answer(done)["error"]["where"]["file"] == f"/proc/out.{ending}"


def test_a_read_only_folder_is_found_before_the_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from multibody_sym.cli.runs import verify_target

    monkeypatch.setattr(os, "access", lambda _folder, mode: mode != os.W_OK)
    with pytest.raises(OutputError, match="cannot be written"):
        verify_target(str(tmp_path / "out.csv"))


def test_a_reader_that_stops_is_no_error() -> None:
    process = subprocess.Popen(
        f"{sys.executable} -m multibody_sym simulate {PENDULUM} --json | head -c 10",
        shell=True, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )
    out, err = process.communicate(timeout=60)
    assert out == '{"t": [0.0'
    assert "Traceback" not in err
    assert "BrokenPipe" not in err


def test_plot_is_a_picture_and_ignores_the_settings_of_the_folder(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "matplotlibrc").write_text("figure.dpi: 7\nsavefig.dpi: 7\nnonsense: 1\n")
    done = command("simulate", PENDULUM, "--plot", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "matplotlibrc" not in done.stderr
    picture = (tmp_path / "pendulum.png").read_bytes()
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(picture[16:20], "big") == 1600


@pytest.mark.parametrize("start", ["module", "script"])
def test_nothing_is_imported_from_the_working_folder(tmp_path: Path, start: str) -> None:
    for name in ("numpy", "sympy", "yaml", "argparse", "json", "scipy", "multibody_sym_generated"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(99)")
    script = tmp_path / "bin" / "multibody-sym"
    script.parent.mkdir()
    script.write_text("import sys\nfrom multibody_sym.cli.main import main\nsys.exit(main())\n")
    first = ["-m", "multibody_sym"] if start == "module" else [str(script)]
    for formalism in ("composite_body", "lagrange"):
        done = subprocess.run(
            [sys.executable, *first, "simulate", PENDULUM, "--t-end", "1", "--formalism", formalism],
            cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False,
        )
        assert done.returncode == 0, done.stderr


def test_it_runs_from_the_checkout_that_holds_it(tmp_path: Path) -> None:
    usual = {name: value for name, value in environment().items() if name != "PYTHONPATH"}
    done = command("simulate", PENDULUM, "--t-end", "1", cwd=ROOT, env=usual)
    assert done.returncode == 0, done.stderr


def test_every_example_of_a_new_user_runs(tmp_path: Path) -> None:
    assert command("new", cwd=tmp_path).returncode == 0
    done = command("simulate", "pendulum.yaml", "--t-end", "0.5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "pendulum.yaml").read_bytes() == (EXAMPLES / "pendulum.yaml").read_bytes()


def test_step_longer_than_the_run_is_told() -> None:
    done = here("simulate", PENDULUM, "--method", "rk4", "--step", "0.2", "--t-end", "0.1")
    assert "step 0.2 s, longer than the run" in done.stdout


def test_times_of_stages_are_told_where_asked() -> None:
    told = here("simulate", PENDULUM, "--t-end", "1", "--times").stdout
    assert "took " in told
    assert "integrate " in told
    assert answer(here("simulate", PENDULUM, "--t-end", "1", "--times", "--json"))["times"]["integrate"] > 0.0
    assert "times" not in answer(here("simulate", PENDULUM, "--t-end", "1", "--json"))
