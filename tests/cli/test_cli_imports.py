"""What starting the program imports: `--help` next to nothing."""

from __future__ import annotations

import subprocess
import sys

from command import ROOT, environment

SLOW = ("numpy", "sympy", "scipy", "matplotlib", "yaml", "jinja2", "pyarrow", "ctypes", "multibody_sym.model")


def test_help_imports_nothing_slow() -> None:
    program = f"import sys; from multibody_sym.cli import main; main(['--help']); print([m for m in {SLOW!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], env=environment(), cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_importing_the_package_imports_nothing_else() -> None:
    program = "import sys; before = set(sys.modules); import multibody_sym; print(sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", program], env=environment(), cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['multibody_sym']"
