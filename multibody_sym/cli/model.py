"""The model file of a command, and errors that say whether the file or an option is wrong."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from multibody_sym.cli.options import model_options, verify_apart
from multibody_sym.dynamics.start.number_checks import check_numbers, numbers_of
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.errors import MultibodyError, Where, gathered, join_errors
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.mechanics.model_files import ModelPlaces, load_with_places
from multibody_sym.mechanics.spanning_tree import coordinate_names, speed_names
from multibody_sym.model.run_options import ASSIGNED
from multibody_sym.model.system import System
from multibody_sym.scalars.elementary import leaves
from multibody_sym.stages import stage


@contextmanager
def model(options: argparse.Namespace) -> Iterator[System]:
    """Give the system of a command as its file declares it, for a function that takes `model_options`.

    Errors about the model that are raised inside name their place in the file, or the option they come from. Settings
    of runs are verified though the command makes none: commands that do read the same file.
    """
    with open_model(options) as (system, _tables):
        _verify_settings(with_overrides(system, model_options(options)))
        yield system


def _verify_settings(system: System) -> None:
    """Raise ModelError where a run cannot be done as the file says, as far as parameters have values."""
    settings, known = system.simulation, known_values(system)
    if all(leaf in known for leaf in leaves(settings.numbers, "symbol")):
        from multibody_sym.motion.prepare.settings import run_settings  # methods take time to import

        run_settings(settings, known)


@contextmanager
def open_model(options: argparse.Namespace, content: bytes | None = None) -> Iterator[tuple[System, tuple[str, ...]]]:
    """Give the system with the files of its tables; `content`: that of the model file, if it is read already."""

    def verify(part: System) -> None:
        changed, wrong = with_overrides(part, model_options(options)), gathered()
        with wrong:  # settings of runs that are wrong in the file, whatever options say of others
            try:
                _verify_settings(changed)
            except MultibodyError as error:
                if of_file := _by_origin(error, options, changed)[1]:
                    raise join_errors(of_file) from None
        try:
            with wrong:
                check_numbers(changed)
        finally:  # numbers that fail elsewhere hide no settings
            wrong.told()

    def hints() -> list[str]:
        from multibody_sym.analysis.hints import declared_hints  # which a run that is recalled does without

        return [options.told(hint) for hint in declared_hints(asked)]

    with stage("read the model"):
        system, places = load_with_places(options.file, content, verify)
    for table in places.tables:
        for target in (getattr(options, name, None) for name in ("output", "plot")):
            verify_apart(table, target, "a table of the model")
    try:
        asked = with_overrides(system, model_options(options))
        options.told = partial(_hint_text, options, system, places)
        options.hints = hints
        with numbers_of(asked):  # what is written of an answer is computed too
            yield system, places.tables
    except MultibodyError as error:
        of_options, of_file = _by_origin(error, options, system)
        if of_file and of_file[0].where.path:
            of_file = [places.with_others(join_errors(of_file), verify)]
        raise join_errors([*of_options, *of_file]) from None


def _by_origin(
    error: MultibodyError, options: argparse.Namespace, system: System
) -> tuple[list[MultibodyError], list[MultibodyError]]:
    """Return an error and those that it carries, about options and about the file; the former name the options."""
    of_options, of_file = list[MultibodyError](), list[MultibodyError]()
    every, error.others = (error, *error.others), ()
    for each in every:
        option = _option(each.where.path, options, system)
        if option is not None:
            each.where = Where(path=(option,))
        (of_file if option is None else of_options).append(each)
    return of_options, of_file


def _hint_text(options: argparse.Namespace, system: System, places: ModelPlaces, hint: str) -> str:
    """Return a hint with its place in the file, or the option that it is about."""
    path = getattr(hint, "path", ())
    option = _option(path, options, system) if path else None
    told = hint.removeprefix(f"{'.'.join(path)}: ")
    return f"{option}: {told}" if option else places.told(told, path) if path else hint


def _option(path: tuple[str, ...], options: argparse.Namespace, system: System) -> str | None:
    """Return the option that gave what stands at a path of the model; None where the file did."""
    section, name, key = (*path, "", "", "")[:3]
    if section == "joints" and key == "initial":
        declared = system.joints[name]
        names = (*coordinate_names(name, declared), *speed_names(name, declared))
        section, name = key, next((each for each in names if each in options.initial), "")
    if section == "states" and key == "initial" and name in options.initial:
        section = key
    if section in ASSIGNED and name in getattr(options, section):
        return f"{ASSIGNED[section]} {name}"
    word = name if section == "simulation" else section
    given = word not in ASSIGNED and getattr(options, word, None) is not None
    return f"--{word.replace('_', '-')}" if given else None
