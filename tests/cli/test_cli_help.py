"""Help fits a screen, and shells complete words."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from multibody_sym.cli.main import main
from multibody_sym.cli.options import COMMANDS as NAMES


def shown(capture: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert main([*words, "--help"]) == 0
    return capture.readouterr().out.splitlines()


def test_the_help_of_the_program_fits_a_screen(capsys: pytest.CaptureFixture[str]) -> None:
    lines = shown(capsys)
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines[4 : 4 + len(NAMES)]] == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_help_of_a_command_is_short(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    lines = shown(capsys, name)
    assert len(lines) <= (48 if name == "sweep" else 40)
    assert max(map(len, lines)) <= 80


def test_a_method_that_is_none_names_all(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["new", "-o", str(tmp_path / "p.yaml")]) == 0
    assert main(["simulate", str(tmp_path / "p.yaml"), "--method", "all"]) == 2
    told = capsys.readouterr().err
    assert all(name in told for name in ("dormand_prince", "radau_5", "rk4", "LSODA"))


def test_a_shell_completes_commands_options_and_words(tmp_path: Path) -> None:
    """The script is run by bash as it would complete what is typed."""
    program = "import sys; from multibody_sym.cli.main import main; sys.exit(main(['--print-completion', 'bash']))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    (tmp_path / "completion").write_text(done.stdout, encoding="utf-8")

    def completed(*words: str) -> list[str]:
        typed = " ".join(f"'{word}'" for word in words)
        line = (
            "source completion; function=$(complete -p multibody-sym | sed 's/.*-F \\([^ ]*\\) .*/\\1/'); "
            f"COMP_WORDS=({typed}); COMP_CWORD={len(words) - 1}; $function 2>/dev/null; echo ${{COMPREPLY[@]}}"
        )
        found = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=True)
        return found.stdout.split()

    assert completed("multibody-sym", "lin") == ["linearize"]
    assert completed("multibody-sym", "simulate", "--t-") == ["--t-end"]
    assert completed("multibody-sym", "new", "fur") == ["furuta"]
    assert completed("multibody-sym", "explain", "M10") == [f"M10{k}" for k in range(10)]


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_other_shells_have_a_script_too(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--print-completion", shell]) == 0
    assert "linearize" in capsys.readouterr().out


def test_another_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--print-completion", "fish"]) == 2
    assert "bash" in capsys.readouterr().err
