"""What starting the program imports: `--help` next to nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from command import ROOT, environment

SLOW = ("numpy", "sympy", "scipy", "matplotlib", "yaml", "jinja2", "pyarrow", "ctypes", "multibody_sym.model.system")


def printed(program: str) -> str:
    start = [sys.executable, "-c", program]
    done = subprocess.run(start, env=environment(), cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1]


def test_help_imports_nothing_slow() -> None:
    found = f"print([m for m in {SLOW!r} if m in sys.modules])"
    assert printed(f"import sys; from multibody_sym.cli.main import main; main(['--help']); {found}") == "[]"


def test_importing_the_package_imports_nothing_else() -> None:
    found = "print(sorted(set(sys.modules) - before))"
    assert printed(f"import sys; before = set(sys.modules); import multibody_sym; {found}") == "['multibody_sym']"


def test_a_run_of_a_tree_draws_no_numbers_with_numpy(tmp_path: Path) -> None:
    """`numpy.random` and what it needs take longer to import than a short run."""
    model = ROOT / "examples" / "double_pendulum.yaml"
    arguments = ["simulate", str(model), "--t-end", "0.1", "-o", str(tmp_path / "motion.csv")]
    found = "print([m for m in ('numpy.random', 'secrets', 'sympy') if m in sys.modules])"
    assert printed(f"import sys; from multibody_sym.cli.main import main; main({arguments!r}); {found}") == "[]"


def test_a_run_of_a_contact_imports_no_optimisation(tmp_path: Path) -> None:
    """Linear programs are only for forces that are not unique."""
    model = ROOT / "examples" / "textbook" / "thrown_up.yaml"
    arguments = ["simulate", str(model), "--t-end", "1", "-o", str(tmp_path / "motion.csv")]
    found = "print([m for m in ('scipy.optimize', 'scipy.integrate', 'sympy') if m in sys.modules])"
    assert printed(f"import sys; from multibody_sym.cli.main import main; main({arguments!r}); {found}") == "[]"
