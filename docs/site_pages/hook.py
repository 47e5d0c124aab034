"""The hooks of MkDocs: generated pages stand beside the written ones, and are never files in docs."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

_TYPESET = "<!-- the same equations, typeset -->"
_HIDDEN = {"index.md": ["navigation", "toc"], "gallery/index.md": ["toc"]}
_WEIGHTS = {
    "which_command.md": 2.0,
    "index.md": 1.5,
    "tutorials/": 0.8,
    "guide/(figures|design)": 0.4,
    "how_to_add": 0.4,
    "keys.md": 0.9,
    "reference/python": 0.7,
    "gallery/": 0.3,
}
"""What a hit counts in the search by the beginning of the page's address; elsewhere 1."""


def on_page_markdown(markdown: str, *, page: Any, **_named: Any) -> str:
    """Weigh a page, typeset the equations of the first one, lead links to folders of the checkout to the gallery."""
    address = page.file.src_uri
    page.meta["hide"] = _HIDDEN.get(address, [])
    page.meta["search"] = {"boost": next((x for start, x in _WEIGHTS.items() if re.match(start, address)), 1.0)}
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
