"""`new`: write a commented model file to start from, one of the shipped examples."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Final

from multibody_sym.cli.options import Reply, examples
from multibody_sym.errors import InputError, nearest
from multibody_sym.text.files import write_new

HELP: Final = "write a model file to start from, any of the shipped examples"
STARTER: Final = "pendulum"
_DESCRIPTION: Final = re.compile(r"^description: >-\n((?:  .*\n)+)", re.MULTILINE)
_SENTENCE: Final = re.compile(r".*?(?:[.?](?= |$)|$)")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("name", metavar="NAME", nargs="?", default=STARTER, help=f"an example; default: {STARTER}")
    parser.add_argument("--list", action="store_true", help="list the examples")
    parser.add_argument("-o", "--output", metavar="FILE", help="the file to write; default: NAME.yaml")


def run(options: argparse.Namespace) -> Reply:
    """List the examples, or write one; an existing file is never replaced."""
    known = examples()
    if options.list:
        titles = {name: _title(path) for name, path in known.items()}
        width = max(map(len, titles), default=0)
        return Reply({"examples": titles}, "\n".join(f"{name:{width}}  {title}" for name, title in titles.items()))
    name = options.name
    if name not in known:
        near = nearest(name, known)
        advice = f"; did you mean {near}?" if near else ""
        raise InputError(f"there is no example {name!r}{advice}; `new --list` shows all", number="M106")
    target = options.output or f"{name}.yaml"
    write_new(target, known[name].read_bytes())
    return Reply({"file": target, "example": name}, f"wrote {target}; next: multibody-sym simulate {target} --plot")


def _title(path: Path) -> str:
    """Return the first sentence of an example's description, which stands near its head; read as text, for speed."""
    text = path.read_text(encoding="utf-8")
    found = _DESCRIPTION.search(text)
    said = " ".join(found[1].split()) if found else ""
    return _SENTENCE.match(said)[0]  # type: ignore[index]
