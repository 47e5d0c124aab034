"""Every error: number, cause, cure, and a small file that produces it."""

from __future__ import annotations

from multibody_sym.cli.error_pages import EXPLAINED
from site_pages.markdown import block, plain

_HEAD = """\
# Errors

A message says what was wrong, where (file, line, element) and what to do. The number behind it, such as `[M101]`, is
that of the page below; `multibody-sym explain M101` shows it too. With `--json` it is `error.number`, in Python
`error.number`.

| begins with | about |
|---|---|
| A, I | arguments of calls and options |
| E | expressions |
| F | files |
| M | models |
| N | problems without a solution |
| R | runs |
| O | output, compilers, packages |
| U | command lines |
| X | defects, memory, interruption |
"""


def errors() -> str:
    """Return the page."""
    parts = [_HEAD]
    for number, told in EXPLAINED.items():
        parts.append(f"## {number}: {told.title}\n\n**Cause.** {plain(told.cause)}\n\n**Cure.** {plain(told.cure)}\n")
        if told.file:
            parts.append(f"`multibody-sym {' '.join(told.words)}` of\n\n{block(told.file, 'yaml')}")
        elif told.python:
            parts.append(block(told.python, "python"))
    return "\n".join(parts)
