"""All generated pages by their addresses, each with the function that makes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor

from site_pages import commands, errors, gallery, json_objects, python_api


def generated() -> Mapping[str, Callable[[], str]]:
    """Return how to make each page of the reference, and that of the gallery."""
    return {
        "reference/commands.md": commands.commands,
        **python_api.pages(),
        "reference/json_objects.md": json_objects.json_objects,
        "reference/errors.md": errors.errors,
        "gallery/index.md": gallery.overview,
    }


def of_examples() -> Iterator[tuple[str, str]]:
    """Yield address and text of each example's page and of the files beside it; all cores make them."""
    pages = gallery.pages()
    with ProcessPoolExecutor() as processes:
        for address, made in zip(pages, processes.map(gallery.example_page, pages.values()), strict=True):
            yield address, made.markdown
            if made.figure:
                yield address.replace(".md", ".svg"), made.figure
            if made.film:
                yield address.replace(".md", "_motion.html"), made.film
