"""What `mkdocs build` calls: the generated pages stand beside the written ones, and are never files in docs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

_OF_THE_SITE = """
- Look something up: [commands](reference/commands.md), [Python](reference/python_api.md),
  [JSON](reference/json_objects.md), [errors by number](reference/errors.md).
- Look around: [the gallery](gallery/index.md), a page for every example.
"""


def on_page_markdown(markdown: str, *, page: Any, **_named: Any) -> str:
    """Complete the first page by links to generated pages; lead links to folders of examples to the gallery."""
    if page.file.src_uri == "index.md":
        return markdown.rstrip() + "\n" + _OF_THE_SITE
    return re.sub(r"\]\((?:\.\./)+examples/[^)]*\)", "](../gallery/index.md)", markdown)


def on_files(files: Any, *, config: Any) -> Any:
    """Add the generated pages."""
    folder = str(Path(__file__).parents[1])
    if folder not in sys.path:
        sys.path.insert(0, folder)
    from mkdocs.structure.files import File

    from site_pages.generated import generated

    for address, make in generated().items():
        files.append(File.generated(config, address, content=make()))
    return files
