"""Makes the shared modules beside it (`mechanisms`) importable from every test, and gives all tests one cache.

OpenBLAS has one thread, told before NumPy is imported: tests run beside each other and solve small systems, for which
threads that wait for each other cost ten times what they compute.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep what tests compile out of the user's cache; workers share one, so that each model is compiled once."""
    place = tmp_path_factory.getbasetemp()
    shared = place.parent if "PYTEST_XDIST_WORKER" in os.environ else place
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(shared / "cache"))
        yield
