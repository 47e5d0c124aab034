"""`sweep`: many runs of a model, whose parameters and start values are varied, as one table."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final

from multibody_sym.cli.commands.simulate import figure_name
from multibody_sym.cli.options import Reply, UsageError, add_run_options, asked_units, run_options, verify_apart
from multibody_sym.errors import OutputError, RunError, Where
from multibody_sym.stages import reached

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from multibody_sym.motion.sweep.study import Study

HELP: Final = "run a model many times with varied values: one table, a plot or map"
_OWN: Final = {
    "sample": ("N", "draw so many runs from values and ranges low:high"),
    "seed": ("N", "the seed of what is drawn; default: 0"),
    "workers": ("N", "threads; default: one a processor"),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    varied = (
        "a parameter, or a coordinate or speed at the start, and its values: m1=1:10:100 (low:high:count), "
        "l=.5,1,2 or theta='10:60:6 deg'; several are combined"
    )
    parser.add_argument("--vary", metavar="NAME=VALUES", action="append", default=[], help=varied)
    table = "a table with the values of each run, for --vary"
    parser.add_argument("--rows", metavar="FILE", help=table)
    for name, (what, described) in _OWN.items():
        parser.add_argument(f"--{name}", metavar=what, help=described)
    parser.add_argument("--sobol", action="store_true", help="draw evenly, from Sobol's sequence")
    cluster = "let the workers of a Dask cluster compute, by the address of its scheduler"
    parser.add_argument("--scheduler", metavar="ADDRESS", help=cluster)
    table = "the table, a row a run: .csv, .npz or .parquet; an interrupted sweep goes on when it is called again"
    parser.add_argument("-o", "--output", metavar="OUT", help=table)
    figure = "a figure (.png, .svg, .pdf) over one or two varied values; default: FILE.png"
    parser.add_argument("--plot", metavar="PNG", nargs="?", const="", help=figure)
    shown = "what the figure shows: columns with commas between them, such as 'theta max' (default: all, of maps ends)"
    parser.add_argument("--show", metavar="NAMES", help=shown)
    parser.add_argument("--units", metavar="UNITS", help="units of the figure, such as mm,deg; tables stay SI")
    add_run_options(parser)


def run(options: argparse.Namespace) -> Reply:
    """Run all, and write what was asked for; what Ctrl-C interrupts goes on when it is called again."""
    from multibody_sym.motion.sweep.study import study_summary

    figure = figure_name(options)
    for target in (options.output, figure):
        verify_apart(options.file, target)
        verify_apart(options.rows or "", target, "the table of rows")
    if figure is not None and os.path.isdir(figure):
        raise OutputError("the file cannot be written: it is a folder", where=Where(file=figure), number="O102")
    study = _swept(options)
    if figure is not None:
        study.plot(figure, options.show, asked_units(options))
    written = [path for path in (study.path, figure) if path is not None]
    text = "\n".join([study_summary(study), *(f"wrote {path}" for path in written)])
    failed = len(study.failures) == len(study)
    return Reply({**study.as_json(), "written": written}, text, RunError.exit_code if failed else 0)


def _swept(options: argparse.Namespace) -> Study:
    from multibody_sym.cli.model import model
    from multibody_sym.motion.sweep.study import sweep

    listed = None if options.rows is None else _rows_in(options.rows)
    asked = parse_varied(options.vary) if listed is None or options.vary else None
    with ExitStack() as stack:
        system = stack.enter_context(model(options))
        executor = stack.enter_context(_cluster(options.scheduler))
        return sweep(
            system,
            asked,
            rows=listed,
            **{name: getattr(options, name) for name in (*_OWN, "sobol", "output")},
            executor=executor,
            **run_options(options),
            on_progress=lambda done, total: reached(done / total),
        )


def parse_varied(texts: Sequence[str]) -> dict[str, str]:
    """Return what `--vary` was given, by name. Raises UsageError."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, values = (part.strip() for part in text.partition("="))
        if not (name and equals and values):
            raise UsageError(f"--vary {text!r}: write NAME=VALUES, such as m=1:10:100", where=Where(path=("--vary",)))
        if name in found:
            raise UsageError(f"{name} is varied twice", where=Where(path=("--vary",)))
        found[name] = values
    if not found:
        raise UsageError("nothing is varied: write --vary NAME=VALUES, such as --vary m=1:10:100, or --rows FILE")
    return found


def _rows_in(path: str) -> list[dict[str, float]]:
    """Return the rows of a table, in SI units. Raises InputError for what is no table of numbers."""
    from multibody_sym.text.tables import read_table

    columns = {name: values.tolist() for name, values in read_table(path).columns.items()}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


@contextmanager
def _cluster(address: str | None) -> Iterator[Executor | None]:
    """Give the executor of a Dask cluster. Raises OutputError where there is none at the address."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise OutputError("--scheduler needs Dask: pip install 'multibody_sym[dask]'") from None
    try:
        client: Any = Client(address)
    except (OSError, ValueError) as problem:
        message = f"no scheduler answers at {address}: {problem}"
        raise OutputError(message, where=Where(path=("--scheduler",))) from None
    with client:
        yield client.get_executor()
