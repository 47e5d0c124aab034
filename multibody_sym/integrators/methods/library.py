"""Methods of other libraries by their names: scipy's, and SUNDIALS' through the package scikit-sundae.

Nothing of these is imported here: `steppers` does when a run asks for a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Final

from multibody_sym.errors import OutputError
from multibody_sym.records import dataclass

SCIPY: Final = "scipy"
SUNDIALS: Final = "scikit-sundae"
IDA: Final = "ida"
"""The one method that takes rows as part of its equations."""


class MissingPackageError(OutputError):
    """A method needs a package that is not installed."""

    code = "package"
    number = "O104"


@dataclass(frozen=True)
class LibraryMethod:
    """A method of `package`, with the highest order that it reaches and that of its error estimate."""

    name: str
    order: int
    error_order: int
    package: str


LIBRARY: Final[Mapping[str, Callable[[], LibraryMethod]]] = MappingProxyType(
    {
        name: partial(LibraryMethod, name, order, error_order, package)
        for name, order, error_order, package in (
            ("RK23", 3, 2, SCIPY),
            ("RK45", 5, 4, SCIPY),
            ("DOP853", 8, 7, SCIPY),
            ("Radau", 5, 3, SCIPY),
            ("BDF", 5, 4, SCIPY),
            ("LSODA", 12, 11, SCIPY),
            ("cvode_adams", 12, 11, SUNDIALS),
            ("cvode_bdf", 5, 4, SUNDIALS),
            (IDA, 5, 4, SUNDIALS),
        )
    }
)
