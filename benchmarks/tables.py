"""What tables cost: CPU time a number beside `repr`, and memory beyond that of numpy, of a million rows.

    python benchmarks/tables.py
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import orjson

from multibody_sym.text.tables import Table, read_table, write_table

_ROWS, _COLUMNS, _TRIES = 1_000_000, 5, 3
_WRITE = """
import numpy as np
{before}
values = np.random.default_rng(0).normal(size=({rows}, {columns}))
{after}
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def main() -> None:
    """Print the figures, as minima."""
    rows = np.random.default_rng(0).normal(size=(_ROWS, _COLUMNS))
    table = Table({f"x{k}": column for k, column in enumerate(rows.T.copy())})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.csv"
        took = min(_cpu(lambda: write_table(table, path)) for _ in range(_TRIES)) / rows.size
        few = rows[: _ROWS // 10].ravel().tolist()
        plain = min(_cpu(lambda: list(map(repr, few))) for _ in range(_TRIES)) / len(few)
        same = all(
            np.array_equal(found.view(np.int64), given.view(np.int64))
            for found, given in zip(read_table(path).columns.values(), table.columns.values(), strict=True)
        )
        print(f"{_ROWS} rows of {_COLUMNS} numbers; Python {sys.version.split()[0]}, orjson {orjson.__version__}")
        print(f"CSV: {took * 1e6:.3f} us a number ({plain * 1e6:.3f} by repr alone); the same bits read back: {same}")
        print(f"memory beyond numpy and the numbers: {_memory(path):.0f} MB")


def _cpu(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


def _memory(path: Path) -> float:
    """Return how many MB a process that writes needs beyond one that has the numbers alone."""
    write = f"write_table(Table({{f'x{{k}}': values[:, k] for k in range({_COLUMNS})}}), {os.fspath(path)!r})"
    imported = "from multibody_sym.text.tables import Table, write_table"
    both = [("", ""), (imported, write)]
    first, second = (
        int(subprocess.run(
            [sys.executable, "-c", _WRITE.format(before=a, after=b, rows=_ROWS, columns=_COLUMNS)],
            capture_output=True, text=True, check=True,
        ).stdout)
        for a, b in both
    )
    return (second - first) / 1024


if __name__ == "__main__":
    main()
