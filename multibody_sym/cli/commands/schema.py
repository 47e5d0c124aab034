"""`schema`: the JSON Schema of model files, from which editors complete and explain keys."""

from __future__ import annotations

import argparse
import json
from typing import Final

from multibody_sym.cli.options import Reply

HELP: Final = "write the JSON Schema of model files, which editors use"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("-o", "--output", metavar="FILE", help="the file to write; default: standard output")


def run(options: argparse.Namespace) -> Reply:
    """Write the schema; an existing file is never replaced."""
    from multibody_sym.model.schema import schema
    from multibody_sym.text.files import write_new

    found = schema()
    text = json.dumps(found, indent=1)
    if options.output is None:
        return Reply(found, text, source=True)
    write_new(options.output, f"{text}\n".encode())
    first = f"# yaml-language-server: $schema={options.output}"
    return Reply({"file": options.output}, f"wrote {options.output}; as first line of a model: {first}")
