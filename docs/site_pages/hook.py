"""The hooks of MkDocs: generated pages stand beside the written ones, and are never files in docs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

_TYPESET = "<!-- the same equations, typeset -->"


def on_page_markdown(markdown: str, **_named: Any) -> str:
    """Typeset the equations of the first page; lead links to folders of the checkout to the gallery."""
    if _TYPESET in markdown:
        from site_pages.gallery import typeset_equations

        model = markdown.partition("```yaml\n")[2].partition("```")[0]
        markdown = markdown.replace(_TYPESET, typeset_equations(model))
    return re.sub(r"\]\((?:\.\./)+examples/[^)]*\)", "](../gallery/index.md)", markdown)


def on_files(files: Any, *, config: Any) -> Any:
    """Add the generated pages, figures and films."""
    folder = str(Path(__file__).parents[1])
    if folder not in sys.path:
        sys.path.insert(0, folder)
    from mkdocs.structure.files import File

    from site_pages.generated import generated, of_examples

    made = [*((address, make()) for address, make in generated().items()), *of_examples()]
    for address, text in made:
        files.append(File.generated(config, address, content=text))
    return files
