"""Generated C compiled into a library and called through its table of programs."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from multibody_sym.program.program import Program

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
DOUBLES = ctypes.POINTER(ctypes.c_double)
INTS = ctypes.POINTER(ctypes.c_int)
CALL = ctypes.CFUNCTYPE(None, ctypes.POINTER(DOUBLES), ctypes.POINTER(DOUBLES))


def compiler() -> str:
    """Return the path of the C compiler; the test is skipped where there is none."""
    path = shutil.which("cc")
    if path is None:
        pytest.skip("no C compiler (cc)")
    return path


class Entry(ctypes.Structure):
    """mbs_program."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("n_in", ctypes.c_int),
        ("in_sizes", INTS),
        ("n_out", ctypes.c_int),
        ("out_sizes", INTS),
        ("call", CALL),
    )


class Library:
    """A compiled model."""

    def __init__(self, sources: Mapping[str, str], folder: Path, *flags: str) -> None:
        folder.mkdir(exist_ok=True)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="ascii")
        path = folder / "model.so"
        files = [name for name in sources if name.endswith(".c") and name != "selftest.c"]
        command = [compiler(), *STRICT, *flags, "-fPIC", "-shared", *files, "-lm", "-o", str(path)]
        subprocess.run(command, cwd=folder, check=True, timeout=300)
        self.library = ctypes.CDLL(str(path))
        count = ctypes.c_int.in_dll(self.library, "mbs_program_count").value
        self.entries = list((Entry * count).in_dll(self.library, "mbs_programs"))

    @property
    def names(self) -> list[str]:
        return [entry.name.decode() for entry in self.entries]

    def run(self, name: str, program: Program, arrays: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the outputs of the program called `name`, each with a guard behind it that must stay untouched."""
        entry = self.entries[self.names.index(name)]
        assert entry.in_sizes[: entry.n_in] == [a.size for a in program.inputs]
        assert entry.out_sizes[: entry.n_out] == [len(o.values) for o in program.outputs]
        given = [np.append(np.asarray(a, dtype=float).ravel(), 777.0) for a in arrays]
        found = [np.append(np.full(len(o.values), -1e300), 777.0) for o in program.outputs]
        entry.call(_pointers(given), _pointers(found))
        assert all(a[-1] == 777.0 for a in given + found)
        return [a[:-1].reshape(o.shape) for a, o in zip(found, program.outputs, strict=True)]


def _pointers(arrays: Sequence[np.ndarray]) -> ctypes.Array[DOUBLES]:  # type: ignore[valid-type]
    return (DOUBLES * max(1, len(arrays)))(*[a.ctypes.data_as(DOUBLES) for a in arrays])
