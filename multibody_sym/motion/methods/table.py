"""Every integration method by name: in a few words in `SUMMARIES`, as the record that holds it in `METHODS`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import MappingProxyType
from typing import Final, Protocol

from multibody_sym.records import dataclass

SUMMARIES: Final[Mapping[str, str]] = {
    "auto": "dormand_prince; moreau where more than 1,000 contacts may meet, and no step and tolerances are given",
    "explicit_euler": "order 1, fixed step",
    "midpoint": "order 2, fixed step",
    "heun": "order 2, fixed step",
    "rk4": "order 4, fixed step",
    "bogacki_shampine": "order 3(2), adaptive",
    "dormand_prince": "order 5(4), adaptive",
    "dormand_prince_8": "order 8(5,3), adaptive; for high accuracy",
    "adams_bashforth_moulton": "order 4, fixed step, two evaluations a step",
    "stoermer_6": "order 6, fixed step, two evaluations a step",
    "stoermer_verlet": "order 2, fixed step; keeps the energy of smooth conservative motions bounded",
    "implicit_euler": "order 1, adaptive, implicit, for stiff systems",
    "implicit_midpoint": "order 2, fixed step, implicit",
    "trapezoid": "order 2, fixed step, implicit",
    "gauss_4": "order 4, fixed step, implicit; keeps quadratic invariants",
    "gauss_6": "order 6, fixed step, implicit; keeps quadratic invariants",
    "radau_3": "Radau IIA, order 3(2), adaptive, implicit, for stiff systems",
    "radau_5": "Radau IIA, order 5(3), adaptive, implicit; the choice for stiff systems",
    "moreau": "order 1, fixed step, for heaps: all contacts of a step at once, by impulses; events are not located",
    "RK23": "scipy's, order 3(2), adaptive",
    "RK45": "scipy's, order 5(4), adaptive",
    "DOP853": "scipy's, order 8(5,3), adaptive",
    "Radau": "scipy's, order 5, adaptive, implicit",
    "BDF": "scipy's, order 1 to 5, adaptive, implicit",
    "LSODA": "scipy's, Adams and BDF by turns, adaptive",
    "cvode_adams": "SUNDIALS', order 1 to 12, adaptive; needs multibody-sym[sundials]",
    "cvode_bdf": "SUNDIALS', order 1 to 5, adaptive, implicit; needs multibody-sym[sundials]",
    "ida": "SUNDIALS', order 1 to 5, adaptive, implicit, for equations of index 2; needs multibody-sym[sundials]",
}
"""What each method is; the names are those that a model file and `--method` take."""
COLLOCATION: Final = (
    "implicit_euler", "implicit_midpoint", "trapezoid", "gauss_4", "gauss_6", "radau_3", "radau_5"
)  # fmt: skip
"""Implicit Runge-Kutta methods."""
INDEX_2: Final = ("implicit_euler", "trapezoid", "radau_3", "radau_5")
"""Those whose last stage is the end of the step, so that rows that hold at the stages hold there too."""
LOOKING_BACK: Final = ("adams_bashforth_moulton", "stoermer_6", "stoermer_verlet")
"""Those that take steps before into account."""
AUTO: Final = "auto"
"""The default, which is one of two others."""
MOREAU: Final = "moreau"
"""Time stepping of contacts, which takes no others."""
OF_SECOND_ORDER: Final = ("stoermer_6", "stoermer_verlet")
"""Those for second derivatives, which take no declared states."""


def _maker(name: str) -> Callable[[], Method]:
    from multibody_sym.motion.methods.explicit import EXPLICIT

    if name == AUTO:
        return EXPLICIT["dormand_prince"]
    if name in EXPLICIT:
        return EXPLICIT[name]
    from multibody_sym.motion.methods.multistep import IMPLICIT

    if name in IMPLICIT:
        return IMPLICIT[name]

    if name in LIBRARY:
        return LIBRARY[name]
    if name == MOREAU:
        return TimeStepping
    from multibody_sym.motion.methods.multistep import MULTISTEP

    return MULTISTEP[name]


class _Methods(Mapping[str, "Method"]):
    """The methods by name, each made, and so checked, when it is first asked for: the checks take some milliseconds."""

    def __init__(self) -> None:
        self._made: dict[str, Method] = {}

    def __getitem__(self, name: str) -> Method:
        if name not in self._made:
            self._made[name] = _maker(name)()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(SUMMARIES)

    def __len__(self) -> int:
        return len(SUMMARIES)


METHODS: Final = _Methods()
"""Each method's record."""


class Method(Protocol):
    """A method as data: its name, its order, and the order of its error estimate, 0 without one."""

    @property
    def name(self) -> str: ...
    @property
    def order(self) -> int: ...
    @property
    def error_order(self) -> int: ...


@dataclass(frozen=True)
class TimeStepping:
    """Moreau's time stepping (`motion.runs.contact_steps`): order 1 across impacts, 2 between them."""

    name: str = MOREAU
    order: int = 1
    error_order: int = 0


# ----------------------------------------------------------------------------------------------------------------------
# Methods of other libraries by their names: scipy's, and SUNDIALS' through the package scikit-sundae.
#
# Nothing of these is imported here: `steppers` does when a run asks for a step.


SCIPY: Final = "scipy"
SUNDIALS: Final = "scikit-sundae"
IDA: Final = "ida"
"""The one method that takes rows as part of its equations."""
BY_JACOBIAN: Final = ("Radau", "BDF", "LSODA", "cvode_bdf", IDA)
"""The implicit ones, which take the Jacobian."""


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
