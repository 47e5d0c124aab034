"""All pages of errors, by their numbers."""

from __future__ import annotations

from typing import Final

from multibody_sym.cli.explained.inputs import INPUTS
from multibody_sym.cli.explained.models import MODELS
from multibody_sym.cli.explained.page import Explained
from multibody_sym.cli.explained.results import RESULTS

EXPLAINED: Final[dict[str, Explained]] = {**INPUTS, **MODELS, **RESULTS}
NEVER_ON_PURPOSE: Final = ("N105", "N107", "O100", "O103", "O104", "X100", "X101", "X102", "X103")
"""Numbers that no small file shows: they hang on the machine, on a defect, or on a file of some length."""
