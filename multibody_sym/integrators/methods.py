"""The table of all methods by name."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from multibody_sym.integrators.flow import Method
from multibody_sym.integrators.runge_kutta import EXPLICIT

METHODS: Final[MappingProxyType[str, Method]] = MappingProxyType({method.name: method for method in EXPLICIT})
