"""How a line of words ends that names no command, or asks for what is shown instead."""

from __future__ import annotations

from multibody_sym.errors import InputError


class UsageError(InputError):
    """The words of a command line make no command."""

    code = "usage"
    number = "U101"


class Shown(SystemExit):
    """What `--help` and `--version` show, instead of ending the process."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.text = text
