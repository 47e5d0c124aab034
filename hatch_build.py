"""Wheels of a platform: with the runtime compiled, so that a first run compiles its model alone.

    MULTIBODY_SYM_PLATFORM=linux_x86_64 python -m build --wheel

The value is the wheel's platform tag; without it the wheel is that of every platform, and what it lacks is compiled
where it runs. Release builds ask for it in the containers of cibuildwheel, whose compilers are old enough for all.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Objects(BuildHookInterface):  # type: ignore[type-arg]
    """Puts the objects of the runtime into a wheel."""

    def dependencies(self) -> list[str]:
        """Return the packages that building needs: those of a run where the runtime is compiled."""
        return list(self.metadata.core.dependencies) if os.environ.get("MULTIBODY_SYM_PLATFORM") else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the runtime, where a wheel of a platform is asked for."""
        platform = os.environ.get("MULTIBODY_SYM_PLATFORM")
        if not platform or version == "editable":
            return
        sys.path.insert(0, self.root)
        from multibody_sym.program.loading import BROUGHT, objects_to_bring
        from multibody_sym.program.target_layout import runtime_files, stand_in_files

        with tempfile.NamedTemporaryFile(delete=False) as file:
            file.write(objects_to_bring({**runtime_files(), **stand_in_files()}))
        self.made = Path(file.name)
        build_data.update(pure_python=False, tag=f"py3-none-{platform}")
        build_data["force_include"][file.name] = f"multibody_sym/program/{BROUGHT}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Delete what is in the wheel now."""
        made = getattr(self, "made", None)
        if made is not None:
            made.unlink()
