"""All formalisms by name: independent routes from a mechanism to the same equations of motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from multibody_sym.dynamics.composite_body import composite_body
from multibody_sym.dynamics.programs import Formalism

DEFAULT: Final = "composite_body"
FORMALISMS: Final[Mapping[str, Formalism]] = {"composite_body": composite_body}
