"""`simulate`: the motion of a model as a table, a plot and a summary."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.coordinates import add_coordinates
from multibody_sym.errors import InputError, Where
from multibody_sym.integrators.methods import SUMMARIES

if TYPE_CHECKING:
    from multibody_sym.simulation.samples import Samples
    from multibody_sym.simulation.trajectory import Trajectory

HELP: Final = "compute the motion: a table, a plot, a summary"
_FIGURES: Final = (".png", ".svg", ".pdf")
_INTERRUPTED: Final = 130
_SETTINGS: Final = {
    "t_end": "until when, such as 10 or '2*pi*sqrt(l/g)'",
    "method": "; ".join(f"{name}: {words}" for name, words in SUMMARIES.items()),
    "step": "a fixed step in s",
    "rtol": "relative tolerance of an adaptive method",
    "atol": "absolute tolerance of an adaptive method",
    "samples": "number of evenly spaced rows, both ends among them",
    "constraints": "how constraints are kept: projection, baumgarte or index_2",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    add_coordinates(parser)
    parser.add_argument("-o", "--output", metavar="OUT", help="the table: .csv, .npz or .parquet")
    figure = "a figure (.png, .svg, .pdf); default: FILE.png"
    parser.add_argument("--plot", metavar="PNG", nargs="?", const="", help=figure)
    for name, described in _SETTINGS.items():
        parser.add_argument("--" + name.replace("_", "-"), metavar=name.upper(), help=described)
    parser.add_argument("--native", action="store_true", help="code for this processor only")
    parser.add_argument("--backend", choices=("c", "python"), help="default: C, or Python where there is no compiler")


def run(options: argparse.Namespace) -> Answer:
    """Simulate and write what was asked for; a run that Ctrl-C ends keeps its rows."""
    figure = _figure_name(options)
    if options.output is not None:
        from multibody_sym.cli.recording import verify_target

        verify_target(options.output)
    done = _simulated(options)
    written = _written(options.output, figure, done)
    from multibody_sym.report.run_summary import run_summary

    text = "\n".join([run_summary(done), *(f"wrote {path}" for path in written)])
    return Answer({**done.as_json(), "written": written}, text, _INTERRUPTED if done.interrupted else 0)


def _figure_name(options: argparse.Namespace) -> str | None:
    if options.plot is None:
        return None
    name: str = options.plot or os.path.splitext(os.path.basename(options.file))[0] + _FIGURES[0]
    if os.path.splitext(name)[1].lower() not in _FIGURES:
        message = f"a figure is written to {', '.join(_FIGURES)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name))
    return name


def _simulated(options: argparse.Namespace) -> Trajectory:
    from multibody_sym.cli.model import model
    from multibody_sym.report.progress import progress_bar
    from multibody_sym.simulation.simulate import simulate

    settings = {name: getattr(options, name) for name in _SETTINGS}
    with ExitStack() as stack:
        system = stack.enter_context(model(options))
        show = stack.enter_context(progress_bar())
        keep = _keeper(stack, options.output)

        def progress(new: Samples, part: float) -> None:
            show(part)
            keep(new)

        return simulate(
            system,
            **settings,
            formalism=options.formalism,
            native=options.native,
            backend=options.backend,
            on_progress=progress,
        )


def _keeper(stack: ExitStack, output: str | None) -> Callable[[Samples], None]:
    if output is None:
        return _forget
    from multibody_sym.cli.recording import recorded

    return stack.enter_context(recorded(output))


def _forget(_new: Samples) -> None:
    """Keep nothing: no table was asked for."""


def _written(output: str | None, figure: str | None, done: Trajectory) -> list[str]:
    if output is not None:
        from multibody_sym.cli.recording import finish

        finish(output, done)
    if figure is not None:
        done.plot(figure)
    return [path for path in (output, figure) if path is not None]
