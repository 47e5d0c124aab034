"""`simulate`: the motion of a model as a table, a plot and a summary."""

from __future__ import annotations

import argparse
import os
from contextlib import ExitStack
from dataclasses import asdict
from typing import TYPE_CHECKING, Final

from multibody_sym.cli.options import (
    INTERRUPTED,
    Reply,
    add_digits,
    add_run_options,
    add_units,
    asked_units,
    verify_apart,
)
from multibody_sym.errors import InputError, OutputError, Where
from multibody_sym.stages import reached, stage, time_stages

if TYPE_CHECKING:
    from multibody_sym.cli.runs import Recording
    from multibody_sym.motion.results.samples import Samples
    from multibody_sym.motion.results.trajectory import Trajectory

HELP: Final = "compute the motion: a table, a plot, a summary"
_FIGURES: Final = (".png", ".svg", ".pdf")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("-o", "--output", metavar="OUT", help="the table: .csv, .npz or .parquet")
    add_units(parser)
    add_digits(parser)
    figure = "a figure (.png, .svg, .pdf); default: FILE.png"
    parser.add_argument("--plot", metavar="PNG", nargs="?", const="", help=figure)
    shown = "names that the figure shows, with commas; default: all"
    parser.add_argument("--show", metavar="NAMES", help=shown)
    parser.add_argument("--x", metavar="NAME", help="over what it is drawn: a name instead of time")
    verify = "report the residuals of the momentum and energy theorems"
    parser.add_argument("--verify", action="store_true", help=verify)
    times = "report the times of the stages of the run"
    parser.add_argument("--times", action="store_true", help=times)
    add_run_options(parser)


def run(options: argparse.Namespace) -> Reply:
    """Simulate and write what was asked for; a run that Ctrl-C ends keeps its rows."""
    units, figure = asked_units(options), figure_name(options)
    for target in (options.output, figure):
        verify_apart(options.file, target)
        verify_apart(options.samples or "", target, "the times of samples")
    table = None
    if options.output is not None:
        from multibody_sym.cli.runs import Recording

        table = Recording(options.output, units)
    with time_stages("other") as times:
        done = _simulate(options, table)
    if table is not None:
        table.finish(done)
    if figure is not None:
        with stage("plot"):
            done.plot(figure, units, show=options.show, x=options.x or "t")
    from multibody_sym.documents.runs import run_summary

    lines = [run_summary(done, units)]
    answer = dict(done.as_json()) if options.json else {}  # lists of a million rows take longer than the run
    if options.verify:
        from multibody_sym.documents.solution import theorems_text

        misses = done.verified()
        lines += theorems_text(misses, units)
        answer["theorems"] = {name: asdict(miss) for name, miss in misses.items()}
    if options.times:
        lines.append(str(times))
        answer["times"] = times.seconds
    answer["written"] = [path for path in (table and table.place, figure) if path is not None]
    lines += [f"wrote {path}" for path in answer["written"]]
    code, missed = INTERRUPTED if done.interrupted else 0, ""
    if table is not None and table.lost:
        missed = f"{table.path} is another run's: it was written while this one lasted"
        code = code or OutputError.exit_code
    return Reply(answer, "\n".join(lines), code, missed)


def _simulate(options: argparse.Namespace, table: Recording | None) -> Trajectory:
    """Return the run, which shows its progress and fills the table."""
    from multibody_sym.cli.runs import asked_run

    with ExitStack() as stack:
        run = stack.enter_context(asked_run(options))
        keep = None if table is None else stack.enter_context(table.recorded())

        def progress(new: Samples, part: float) -> None:
            reached(part)
            if keep is not None:
                keep(new)

        return run(progress)


def figure_name(options: argparse.Namespace) -> str | None:
    """Return the name of the figure that `--plot` asks for. Raises InputError for an ending that is none."""
    if options.plot is None:
        given = [f"--{name}" for name in ("show", "x") if getattr(options, name, None)]
        if given:
            raise InputError(f"{' and '.join(given)} says what a figure shows: add --plot")
        return None
    name: str = options.plot or os.path.splitext(os.path.basename(options.file))[0] + _FIGURES[0]
    if os.path.splitext(name)[1].lower() not in _FIGURES:
        message = f"a figure is written to {', '.join(_FIGURES)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name), number="U103")
    return name
