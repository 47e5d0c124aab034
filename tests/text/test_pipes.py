"""Pipes as model files and as results: what is in them is read and written, and nobody waits without a word."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.text.files import PipeNotice, write_whole

ROOT = Path(__file__).parents[2]
MODEL = """
multibody_sym: 1
name: falling
bodies: {b: {mass: 1}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 1}}}
simulation: {t_end: 1, samples: 2}
"""

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes")


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    path = tmp_path / "pipe.csv"
    os.mkfifo(path)
    return path


def test_a_pipe_to_which_nobody_writes_is_no_model(pipe: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for load in (mbs.load, mbs.load_urdf):
        with pytest.raises(mbs.InputError, match="nobody writes to this pipe"):
            load(pipe)
    assert main(["check", str(pipe)]) == 2
    assert "nobody writes to this pipe" in capsys.readouterr().err


def test_a_pipe_is_a_model_whenever_it_is_written() -> None:
    for before in ("", "sleep 0.2; "):
        code = "import multibody_sym as mbs; print(mbs.load('/dev/stdin').name)"
        script = f'({before}printf "%s" "$1"; {before}printf " ") | "$2" -c "$3"'
        words = ["sh", "-c", script, "sh", MODEL, sys.executable, code]
        done = subprocess.run(words, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, check=True)
        assert done.stdout == b"falling\n"


def test_a_model_that_is_longer_than_a_pipe_holds_is_read_whole(pipe: Path) -> None:
    text = MODEL + "# " + 200_000 * "x" + "\nparameters: {last: 7}\n"
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    writer = threading.Thread(target=pipe.write_text, args=(text,))
    writer.start()
    while not os.get_blocking(reader) and not _filled(reader):
        time.sleep(0.01)
    assert list(mbs.load(pipe).parameters) == ["last"]
    writer.join(10)
    os.close(reader)


def _filled(descriptor: int) -> bool:
    import select

    return bool(select.select([descriptor], [], [], 0)[0])


def test_a_result_waits_for_a_reader_with_a_word(pipe: Path) -> None:
    read: list[bytes] = []

    def late() -> None:
        time.sleep(0.2)
        read.append(pipe.read_bytes())

    reader = threading.Thread(target=late)
    reader.start()
    with pytest.warns(PipeNotice, match="nobody reads the pipe .* yet"):
        write_whole(pipe, b"content")
    reader.join(10)
    assert read == [b"content"]


def test_a_sweep_into_a_pipe_says_that_nobody_reads_it(tmp_path: Path, pipe: Path) -> None:
    (tmp_path / "m.yaml").write_text(MODEL)
    asked = ["sweep", str(tmp_path / "m.yaml"), "--vary", "x=1,2", "-o", str(pipe)]
    words = [sys.executable, "-m", "multibody_sym", *asked]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"note: nobody reads the pipe")
        assert pipe.read_bytes().count(b"\n") > 2
        told, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert b"falling: 2 runs" in told
