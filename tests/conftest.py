"""Makes the shared modules beside it (`mechanisms`) importable from every test, and gives all tests one cache.

OpenBLAS has one thread, told before NumPy is imported: tests run beside each other and solve small systems, for which
threads that wait for each other cost ten times what they compute.
"""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from quick_compiler import compile_soon

from multibody_sym.program import cache

ROOM = 2**30
"""Bytes: compilers of both workers take far less."""

SHORT = frozenset({"scalars", "text"})
"""Folders whose tests take milliseconds each."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put short tests last, so that at the end no worker waits for what takes another one long."""
    top = Path(__file__).parent
    items.sort(key=lambda item: SHORT.intersection(item.path.relative_to(top).parts[:1]) != set())


def pytest_collection_finish() -> None:
    """Look for garbage seldom, and never again among what is imported: that took an eighth of the time of all tests."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 10, 10)


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep what tests compile out of the user's cache; workers share one, so that each model is compiled once."""
    place = tmp_path_factory.getbasetemp()
    shared = place.parent if "PYTEST_XDIST_WORKER" in os.environ else place
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(shared / "cache"))
        yield


@pytest.fixture(scope="session", autouse=True)
def models_compiled_soon() -> Iterator[None]:
    """Compile models of this process soon, and keep them: no time goes into which of thousands of files to delete.

    Commands in processes of their own optimise them. Compilers work in memory where the machine has room there: each
    library is linked from some twenty files, for which a disk takes as long as the linker.
    """
    memory = Path("/dev/shm")
    with pytest.MonkeyPatch.context() as patch:
        compile_soon(patch)
        if memory.is_dir() and os.access(memory, os.W_OK) and shutil.disk_usage(memory).free > ROOM:
            patch.setattr(tempfile, "tempdir", str(memory))
        patch.setattr(cache, "_MOST_FILES", 1_000_000)
        yield
