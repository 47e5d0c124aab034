"""Commands with all their options, from their parsers."""

from __future__ import annotations

import argparse
import inspect

from multibody_sym.cli import options
from multibody_sym.motion.methods.table import SUMMARIES
from site_pages.markdown import block, cell, code, paragraphs, table


def parsers() -> dict[str, argparse.ArgumentParser]:
    """Return the parser of each command by its name; other names of it are told in its section."""
    made = options._parser()[1]
    return {name: made[name] for name in options.COMMANDS}


def commands() -> str:
    """Return the page."""
    whole = options._parser()[0]
    sections = map(_section, parsers())
    return "\n".join(["# Commands\n", block(whole.format_help(), "text"), *sections, _METHODS, _methods(), _COMPLETION])


_METHODS = "## Integration methods\n\n`--method` of runs, and `simulation: {method: ..}` of a model file.\n"
_COMPLETION = """\
## Completion

With `pip install 'multibody-sym[completion]'` a shell completes commands, options, examples, methods and errors:

```sh
multibody-sym --print-completion bash > ~/.local/share/bash-completion/completions/multibody-sym
multibody-sym --print-completion zsh > "${fpath[1]}/_multibody-sym"
```
"""


def _methods() -> str:
    return table(("method", "what it is"), [(code(name), cell(words)) for name, words in SUMMARIES.items()])


def _section(name: str) -> str:
    parser = parsers()[name]
    module = options.command_module(name)
    rows = [_row(action) for action in parser._actions if not isinstance(action, argparse._HelpAction)]
    usage = " ".join(parser.format_usage().removeprefix("usage: ").split())
    doc = paragraphs(inspect.getdoc(module)).partition(": ")[2]
    others = " and ".join(map(code, getattr(module, "ALIASES", ())))
    text = f"{doc[:1].upper()}{doc[1:]}" + (f" It is called {others} too." if others else "")
    return f"## {name}\n\n{text}\n\n{block(usage, 'sh')}\n{table(('option', 'value', 'meaning'), rows)}"


def _row(action: argparse.Action) -> list[str]:
    names = ", ".join(map(code, action.option_strings)) or code(str(action.metavar or action.dest))
    choices = ", ".join(map(str, action.choices)) if action.choices else ""
    value = "" if action.nargs == 0 or not action.option_strings else code(choices or str(action.metavar or ""))
    return [names, value, cell(action.help or "")]
