"""`simulate`: from a declared system to its motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Unpack

from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.errors import InputError, at
from multibody_sym.mechanics.changes import Overrides, with_overrides, with_settings
from multibody_sym.mechanics.spanning_tree import start_names
from multibody_sym.model.argument_checks import callback, door, flag, values_by_name
from multibody_sym.model.fields import list_items
from multibody_sym.model.run_options import RUN_SETTINGS, RunOptions, spelled_out
from multibody_sym.model.settings import Baumgarte
from multibody_sym.model.system import System
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.methods.table import MOREAU
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of
from multibody_sym.motion.prepare.records import PreparedSystem
from multibody_sym.motion.results.samples import RunInModes, RunStart, Samples
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError, Progressed, run, trajectory_of
from multibody_sym.program.backend import Backend, Native
from multibody_sym.records import dataclass
from multibody_sym.scalars.numbers import floats

if TYPE_CHECKING:
    from multibody_sym.motion.runs.family import VariedRun, VariedSystem
    from multibody_sym.motion.runs.held_inputs import HeldInputs, SampledInputs
    from multibody_sym.motion.stepper import Stepper

Columns = Mapping[str, Sequence[float]]
"""Numbers of runs by name, as many for each name."""


@spelled_out(RunOptions)
def simulate(
    system: System, *, on_progress: Callable[[Samples, float], None] | None = None, **options: Unpack[RunOptions]
) -> Trajectory:
    """Return the motion of a system from its start at t = 0, after an `impact` if it has one, to `t_end`.

    `t_end` to `constraints` replace the keys of `simulation:` in a model file: numbers, expressions of parameters, or
    text such as `2 s`. `samples` is a number of rows, evenly spaced, or their times in s. `parameters` to `project`
    change the system for this call. `formalism` None selects the cheapest one. `native` and `backend` ("c", "python")
    select the code (`program.backend.Native`). `on_progress` is called about ten times a second with the new samples
    and the finished part of the time.
    A function among `inputs` is a controller, `inputs={"tau": law, "every": "1 ms"}`: law(t, q, u), with q (nq,) and u
    (nu,), returns the value that is held until the next sample; of several inputs, `("tau1", "tau2"): law`, all values.
    Ctrl-C ends the run, and the motion until then is returned.
    Raises InputError, NoSolutionError (no start, no inertia) and RunError, whose `trajectory` is the motion until then.
    """
    prepared = prepared_by(system, options)
    return prepared.run(on_progress=callback("on_progress", on_progress))


@spelled_out(RunOptions)
def prepare(system: System, **options: Unpack[RunOptions]) -> Prepared:
    """Return a system prepared to be run again and again: `prepare(system).run()` is `simulate(system)`.

    Arguments as for `simulate`. Raises InputError and NoSolutionError.
    """
    prepared = prepared_by(system, options)
    prepared.verify()
    return prepared


def _in_two_parts(inputs: Any) -> tuple[Any, SampledInputs | None]:
    """Return inputs of a run for the model, and those that functions give, which few runs have."""
    if not isinstance(inputs, Mapping) or not any(map(callable, inputs.values())):
        return inputs, None
    from multibody_sym.motion.runs.held_inputs import sampled_inputs

    return sampled_inputs(inputs)


def prepared_by(system: System, options: RunOptions) -> Prepared:
    """Return the system as options change it and say how it is run; nothing is computed yet. Raises InputError."""
    inputs, sampled = _in_two_parts(options.get("inputs"))
    settings: dict[str, Any] = {name: options.get(name) for name in RUN_SETTINGS}
    word = settings["constraints"]
    if isinstance(word, Baumgarte):
        settings["constraints"] = {"baumgarte": word}
    elif isinstance(word, str):
        named = {"baumgarte": {"baumgarte": {}}, "projection": {"projection": True}, "index_2": {"index_2": True}}
        settings["constraints"] = named.get(word, word)
    own: RunOptions = {**options, "inputs": inputs}
    changed = with_settings(with_overrides(system, own), settings)
    native = flag("native", options.get("native", False))
    return Prepared(changed, options.get("formalism"), native, options.get("backend"), sampled)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A `system` that is resolved, started and compiled once, for many runs, with inputs that are `sampled` in them.

    Runs with other values are resolved and started anew, since other contacts may touch or slide then; Programs are not
    compiled again.
    """

    system: System
    formalism: str | None = None
    native: bool = False
    backend: Backend | None = None
    sampled: SampledInputs | None = None

    @door
    def run(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        initial: Mapping[str, Any] | None = None,
        inputs: Mapping[str, Any] | None = None,
        t_end: Any = None,
        samples: Any = None,
        on_progress: Callable[[Samples, float], None] | None = None,
    ) -> Trajectory:
        """Return the motion, with other values if they are given; arguments and result as for `simulate`.

        It has the bits of the run that `simulate` makes of the same values. Raises InputError, NoSolutionError and
        RunError as that does.
        """
        on_progress = callback("on_progress", on_progress)
        if t_end is not None or samples is not None:
            other = self._until(t_end, samples)
            return other.run(parameters=parameters, initial=initial, inputs=inputs, on_progress=on_progress)
        inputs, sampled = _in_two_parts(inputs)
        if sampled is not None:
            other = replace(self, sampled=sampled)
            return other.run(parameters=parameters, initial=initial, inputs=inputs, on_progress=on_progress)
        alone = inputs is None and self.sampled is None and not self.system.then
        if alone and (found := self._in_numbers(parameters, initial)) is not None:
            (one,) = self.runs(*found)
            return one(on_progress)
        if any(values is not None for values in (parameters, initial, inputs)):
            changed = Overrides(parameters, initial, inputs).of(self.system)
            return replace(self, system=changed).run(on_progress=on_progress)
        if self.system.then:
            return self._in_stages(on_progress)
        return run(run_start(self), on_progress)

    def _in_stages(self, on_progress: Progressed) -> Trajectory:
        from multibody_sym.motion.runs.staged import run_in_stages  # which few systems need

        if self.sampled is not None:
            raise InputError("inputs of functions and stages (then) do not go together; run each stage by itself")
        done = run_in_stages(self.system, lambda stage: replace(self, system=stage).run())
        if on_progress is not None:
            on_progress(done, 1.0)
        return done

    @door
    def stepper(
        self, dt: Any, *, inputs: Sequence[str] | str | None = None, count: int | None = None, threads: int = 1
    ) -> Stepper:
        """Return the system at its start, to be stepped by `dt` (s, or text such as `1 ms`) while `inputs` are held.

        `inputs`: the names of those that each step may change, None for all that drive no motion; `count` of systems
        that step together, in so many `threads`. Raises InputError and NoSolutionError as `run` does.
        """
        from multibody_sym.motion.stepper import Stepper  # which few runs need

        if self.sampled is not None:
            named = ", ".join(self.sampled.names)
            raise InputError(f"{named}: a Stepper holds its inputs itself; give `step` what the functions return")
        return Stepper(self.system, partial(_start_of, self), dt, inputs, count, threads)

    def _until(self, t_end: Any, samples: Any) -> Prepared:
        """Return the system prepared for another end or other samples; the latest one is kept."""
        key = repr((t_end, list_items(samples) or samples))
        if key not in self._others:
            self._others.clear()
            changed = with_settings(self.system, {"t_end": t_end, "samples": samples})
            self._others[key] = replace(self, system=changed)
        return self._others[key]

    @cached_property
    def _others(self) -> dict[str, Prepared]:
        return {}

    @door
    def runs(self, parameters: Columns, initial: Columns) -> Iterator[Callable[[Progressed], Trajectory]]:
        """Yield a function for each run that makes it; each name has a value for each run.

        Each has the bits of the run that is made alone. Raises InputError for names that are not known, and for columns
        that are no numbers or of several lengths.
        """
        parameters, initial = self._columns(parameters, initial)
        if self.sampled is not None or self.system.then:
            for k in range(len(next(iter((*parameters.values(), *initial.values()))))):
                yield partial(self._run_of, None, k, parameters, initial)
            return
        key = tuple(parameters), tuple(initial)
        family = self._families.get(key)
        if family is None:
            from multibody_sym.motion.runs.family import VariedSystem

            made = VariedSystem(self.system, *key, self.formalism, self._code)
            family = self._families.setdefault(key, made)
        for k, member in enumerate(family.members(parameters, initial)):
            yield partial(self._run_of, member, k, parameters, initial)

    def _columns(self, *given: Columns) -> tuple[dict[str, Sequence[float]], ...]:
        """Return the values of parameters and of the start by name, one a run. Raises InputError."""
        named = [values_by_name(x, columns) for x, columns in zip(("parameters", "initial"), given, strict=True)]
        found = tuple(
            {name: _column(name, values, known) for name, values in columns.items()}
            for columns, known in zip(named, self._known, strict=True)
        )
        lengths = {len(values) for columns in found for values in columns.values()}
        if len(lengths) != 1:
            counts = " and ".join(map(str, sorted(lengths))) or "no names"
            raise InputError(f"each name has one value a run; got {counts}")
        return found

    def _run_of(
        self,
        member: VariedRun | None,
        k: int,
        parameters: Columns,
        initial: Columns,
        on_progress: Progressed = None,
    ) -> Trajectory:
        """Return run number k; without a member, or if it fails, the system is examined as by `simulate`."""
        if member is not None:
            try:
                if member.done:
                    return trajectory_of(member)
                return run(RunStart(member.ready, member.problem), on_progress)
            except FailedRunError as error:
                failed = error
        own, begun = ({name: values[k] for name, values in named.items()} for named in (parameters, initial))
        alone = replace(self, system=Overrides(own, begun).of(self.system))
        if member is None:
            return alone.run(on_progress=on_progress)
        alone.verify()  # which tells what is wrong with the start
        raise failed

    def _in_numbers(self, parameters: Any, initial: Any) -> tuple[Columns, Columns] | None:
        """Return the changes as columns of one number, if all are numbers of known names."""
        given = [{} if values is None else values for values in (parameters, initial)]
        if not all(isinstance(values, Mapping) for values in given) or not any(given):
            return None
        for values, known in zip(given, self._known, strict=True):
            if not all(name in known and type(x) in (float, int) for name, x in values.items()):
                return None
        try:
            first, second = ({name: [float(x)] for name, x in values.items()} for values in given)
        except OverflowError:  # told as of every declared number
            return None
        return first, second

    @cached_property
    def _known(self) -> tuple[frozenset[str], frozenset[str]]:
        """The names of parameters, and of coordinates, speeds and states."""
        return frozenset(self.system.parameters), frozenset(start_names(self.system))

    @cached_property
    def _families(self) -> dict[Any, VariedSystem]:
        return {}

    @property
    def _code(self) -> Native:
        return Native(self.native, self.backend)

    def verify(self) -> None:
        """Prepare everything now. Raises InputError and NoSolutionError."""
        if self.system.then:
            check_numbers(self.system)  # of which each stage is prepared as it is reached
        elif self.sampled is not None:
            self._held.verify()
        elif self._problem and self._one_way is not None:
            self._one_way()

    @cached_property
    def _held_inputs(self) -> HeldInputs:
        """The inputs that are sampled, as parameters."""
        from multibody_sym.motion.runs.held_inputs import HeldInputs, held_names

        assert self.sampled is not None
        with at("inputs"):
            return HeldInputs.of(self.system, held_names(self.system, list(self.sampled.names)))

    @cached_property
    def _held(self) -> Prepared:
        """The system whose inputs that are sampled are parameters."""
        return replace(self, system=self._held_inputs.in_system(self.system), sampled=None)

    @cached_property
    def _start(self) -> tuple[System, tuple[Mapping[str, Any], ...]]:
        """The system at the start of its run, and the events of an impact that precedes it."""
        if self.system.impact is None:
            return self.system, ()
        # the laws of impacts are loaded for the few runs that begin with one
        from multibody_sym.dynamics.start.declared_impact import from_impact

        found = from_impact(self.system)
        return found.system, found.events

    @cached_property
    def _ready(self) -> PreparedSystem:
        """What is ready to run."""
        return prepare_system(self._start[0], self.formalism, self._code, modes=True)

    @cached_property
    def _problem(self) -> Problem:
        return problem_of(self._ready, settings_of(self._ready))

    @cached_property
    def _one_way(self) -> Callable[[], RunInModes] | None:
        if self._problem.method.name == MOREAU:
            from multibody_sym.motion.runs.contact_steps import stepped_runs  # which few runs need

            return stepped_runs(self._ready, self._problem, self._code)
        if not self._ready.state.declared.one_way:
            return None
        from multibody_sym.motion.switching.mode_run import one_way_runs  # which few runs need

        in_numbers = settings_of(self._ready)
        return one_way_runs(self._ready, self._problem, in_numbers, self._code)


def _column(name: str, values: Any, known: frozenset[str]) -> Sequence[float]:
    """Return the values of a name, one a run. Raises InputError for an unknown name and what are no numbers."""
    if name not in known:
        raise InputError(f"nothing that runs may vary is called {name!r}", number="M106", word=name, known=known)
    found = floats(name, values)
    if found.ndim != 1:
        raise InputError(f"{name} is to have one value a run, got an array of shape {found.shape}")
    return list(found.tolist())


def system_to_run(prepared: Prepared) -> PreparedSystem:
    """Return what is resolved, started and compiled of a prepared system, without modes of one-way elements."""
    return prepared._ready


def run_start(prepared: Prepared) -> RunStart:
    """Return the start of a run of a prepared system."""
    if prepared.sampled is not None:
        held = prepared._held

        def again(values: Mapping[str, float]) -> RunStart:
            return _start_of(held, Overrides(values).of(held.system))

        from multibody_sym.motion.runs.held_inputs import sampled_start

        return sampled_start(run_start(held), prepared._held_inputs, prepared.sampled, again)
    one_way = prepared._one_way
    modes = None if one_way is None else one_way()
    problem = modes.legs[0].of if modes is not None and modes.legs else prepared._problem.again()
    return RunStart(prepared._ready, problem, modes, prepared._start[1])


def _start_of(prepared: Prepared, system: System) -> RunStart:
    """Return the start of a run of a system as another one is prepared."""
    return run_start(replace(prepared, system=system))
