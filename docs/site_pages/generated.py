"""All generated pages by their addresses, each with the function that makes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from site_pages import commands, errors, gallery, json_objects, python_api


def generated() -> Mapping[str, Callable[[], str]]:
    """Return how to make each page."""
    of_examples = {address: partial(gallery.page, path) for address, path in gallery.pages().items()}
    return {
        "reference/commands.md": commands.commands,
        "reference/python_api.md": python_api.python_api,
        "reference/json_objects.md": json_objects.json_objects,
        "reference/errors.md": errors.errors,
        "gallery/index.md": gallery.overview,
        **of_examples,
    }
