"""`explain`: what the number of an error means, and what to do."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import Reply
from multibody_sym.errors import InputError

HELP: Final = "print the cause and cure of an error by its number, such as M101"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("number", metavar="NUMBER", nargs="?", help="as it stands behind the message; default: all")


def run(options: argparse.Namespace) -> Reply:
    """Tell one number, or the titles of all."""
    from multibody_sym.cli.error_pages import EXPLAINED

    if options.number is None:
        titles = {number: told.title for number, told in EXPLAINED.items()}
        return Reply({"errors": titles}, "\n".join(f"{number}  {title}" for number, title in titles.items()))
    number = options.number.strip("[]").upper()
    if number not in EXPLAINED:
        raise InputError(f"no error has the number {options.number!r}", number="M106", word=number, known=EXPLAINED)
    told = EXPLAINED[number]
    text = f"{number}: {told.title}\n\ncause: {told.cause}\n\ncure: {told.cure}"
    shown = told.file or told.python
    if shown:
        how = f"multibody-sym {told.words[0]} of" if told.file else "in Python"
        text += f"\n\nsuch as {how}\n\n" + "\n".join(f"    {line}" for line in shown.splitlines())
    return Reply({"number": number, "title": told.title, "cause": told.cause, "cure": told.cure}, text)
