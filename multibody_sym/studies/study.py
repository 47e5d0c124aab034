"""What a study found: its table, and what can be made of it."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import ArgumentError, InputError, OutputError, shown
from multibody_sym.expressions.chosen_units import Units, chosen_units
from multibody_sym.model.declaration.doors import door, names
from multibody_sym.records import dataclass
from multibody_sym.studies import tables
from multibody_sym.studies.plan import Plan
from multibody_sym.studies.rows import FAILURE, TEXTS

_TOLD: Final = 100
"""Failures that are told with their reasons where the table does."""


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """The rows of a study: `study["theta max"]` is a column (runs,), in SI units, nan where a run failed.

    `path` is the file of the table, None where there is none; `about` tells model, plan and version; `computed` is how
    many runs were done now, where others were found in a journal.
    """

    plan: Plan
    path: str | None
    about: Mapping[str, Any]
    computed: int
    content: Mapping[str, NDArray[Any]] | None = None

    def __len__(self) -> int:
        return len(self.plan)

    def __repr__(self) -> str:
        return f"<Study of {self.about['system']}: {len(self)} runs over {', '.join(self.varied)}>"

    def __getitem__(self, name: str) -> NDArray[Any]:
        if not isinstance(name, str):
            raise ArgumentError(f"a study is asked by the name of a column, not by {shown(name)}")
        if name not in self.columns:
            raise InputError(f"no column of this study is called {name!r}", word=name, known=self.columns)
        return self.columns[name]

    @property
    def varied(self) -> tuple[str, ...]:
        """What is varied."""
        return self.plan.names

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """All columns (runs,) by name, numbers and texts; read from the file where there is one."""
        if self.content is not None:
            return self.content
        assert self.path is not None
        return tables.read(self.path)[0]

    @property
    def failures(self) -> dict[int, str]:
        """Why runs have no result, by their numbers."""
        reasons = self.columns[FAILURE]
        return {int(k): str(reasons[k]) for k in np.flatnonzero(reasons != "")}

    @property
    def results(self) -> tuple[str, ...]:
        """The columns of numbers that runs gave."""
        return tables.results(self.plan, self.columns)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `sweep --json` prints; nan becomes None."""
        failures = self.failures
        table = {} if self.path else {"table": {name: _plain(column) for name, column in self.columns.items()}}
        return {
            "runs": len(self),
            "computed": self.computed,
            "failed": len(failures),
            "failures": dict(list(failures.items())[:_TOLD]),
            "varied": list(self.varied),
            "results": list(self.results),
            "about": dict(self.about),
            "output": self.path,
            **table,
        }

    @door
    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        show: str | Sequence[str] | None = None,
        units: str | Sequence[str] | Units | None = None,
    ) -> Any:
        """Return a matplotlib figure over one or two varied values, written to `path` if one is given.

        `show` names columns, as text with commas or a list; without it these are all that change, of maps ends alone.
        It has a panel for each unit, SI but for those that `units` chooses, such as `mm,deg`.
        Raises InputError, and OutputError where matplotlib is missing or the file cannot be written.
        """
        from multibody_sym.drawing.plots.files import write_figure
        from multibody_sym.studies.figures import figure_of

        asked = None if show is None else names("show", _listed(show))
        figure = figure_of(self.plan, self.about, self.columns, asked, chosen_units(units))
        if path is not None:
            write_figure(figure, path)
        return figure

    def to_dataframe(self) -> Any:
        """Return the table as a pandas DataFrame, by number of the run. Raises OutputError where pandas is missing."""
        try:
            import pandas
        except ImportError:
            raise OutputError("a DataFrame needs pandas: pip install pandas") from None
        frame = pandas.DataFrame(dict(self.columns)).astype({tables.RUN: int}).set_index(tables.RUN)
        frame.attrs.update(self.about)
        return frame

    def to_xarray(self) -> Any:
        """Return the table as an xarray Dataset: of a grid with a dimension for each varied value, else by run.

        Raises OutputError where xarray is missing.
        """
        try:
            import xarray
        except ImportError:
            raise OutputError("a Dataset needs xarray: pip install xarray") from None
        shape = self.plan.shape
        if self.plan.method == "grid":
            axes: dict[str, NDArray[Any]] = {axis.name: axis.value(np.arange(axis.size)) for axis in self.plan.axes}
            found = (*self.results, *TEXTS)
        else:
            axes, found = {tables.RUN: np.arange(len(self))}, (*self.varied, *self.results, *TEXTS)
        columns = {name: (tuple(axes), self.columns[name].reshape(shape)) for name in found}
        return xarray.Dataset(columns, coords=axes, attrs=dict(self.about))



def _plain(column: NDArray[Any]) -> list[Any]:
    """Return a column as a list, None where a number is not finite."""
    if column.dtype.kind != "f":
        return list(column.tolist())
    return [x if math.isfinite(x) else None for x in column.tolist()]


def _listed(show: Any) -> Any:
    """Return the names in a text that has commas between them."""
    return [name.strip() for name in show.split(",")] if isinstance(show, str) else show
