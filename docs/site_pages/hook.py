"""What `mkdocs build` calls: the generated pages stand beside the written ones, and are never files in docs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any


def on_page_markdown(markdown: str, **_named: Any) -> str:
    """Let links to folders of examples, which are no pages, lead to the gallery."""
    return re.sub(r"\]\((?:\.\./)+examples/[^)]*\)", "](../gallery/index.md)", markdown)


def on_files(files: Any, *, config: Any) -> Any:
    """Add the generated pages and pictures."""
    folder = str(Path(__file__).parents[1])
    if folder not in sys.path:
        sys.path.insert(0, folder)
    from mkdocs.structure.files import File

    from site_pages.generated import generated
    from site_pages.pictures import pictures

    for address, make in (*generated().items(), *pictures().items()):
        files.append(File.generated(config, address, content=make()))
    return files
