"""Runs by time stepping: in each step all contacts strike, press and rub at once, by impulses (method `moreau`).

A step of h s has four parts. What would close within the step, v- < -gap/h, strikes at its start, with Newton's
restitution if it closes faster than loads make it close in a step or two; all other contacts near it stay apart:

    0 <= v+ + e v-  or  0 <= v+ + gap/h,    complementary to p >= 0,    |p_t| <= mu p

Coordinates move on by h/2. There loads act for h s, and contact forces with them, so that nothing is inside anything at
the end of the step, 0 <= v+ + 2 gap/h with the gap there; then coordinates move on by h/2 again (Moreau's midpoint
rule). At last what is inside anything, by rounding and curvature, is put apart by the least change. The work of
impulses is that at mean speeds, so that the energy account is exact but for what the last part lifts. Newton's
coefficients that would make energy, in one impact of several contacts with friction, are zero in that impact.

Sources: J. J. Moreau, Numerical aspects of the sweeping process, Comput. Methods Appl. Mech. Engrg. 177 (1999) 329-349;
V. Acary, Projected event-capturing time-stepping schemes for nonsmooth mechanical systems with unilateral contact and
Coulomb's friction, the same, 256 (2013) 224-250.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from itertools import pairwise
from time import perf_counter
from typing import Any, Final, NoReturn

import numpy as np

from multibody_sym.contact_laws.impact_sequence import RELAXED, ContactRows, sweep
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.errors import InputError
from multibody_sym.mechanics.energy import split
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.motion.integrator.flow import Pairing
from multibody_sym.motion.loop.problem import SECONDS, Loop, Problem, Progress, RunFailure, Statistics
from multibody_sym.motion.prepare.records import LegSamples, PreparedSystem
from multibody_sym.motion.prepare.settings import refusal
from multibody_sym.motion.results.samples import EnergyAccount, FrictionWork
from multibody_sym.motion.switching.law_values import Laws, LawValues, Places, ranges
from multibody_sym.motion.switching.mode_run import laws_of_runs
from multibody_sym.program.backend import Native
from multibody_sym.program.native import ContactsStruct
from multibody_sym.program.runtime_constants import TOUCHING, Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.stages import stage

_SETTLED: Final = 1e-6
"""Part of the largest impulse, by energy, that a sweep changes at most where impulses have settled."""
_SWEEPS: Final = 1000
"""Sweeps of one part of a step at most; what they leave undone is left to the next step."""
_AHEAD: Final = 4.0
"""How many times farther than the fastest gets in a step contacts are looked at."""
_SLOW: Final = 2.0
"""In how many steps loads make a closing speed that does not bounce, or a slip that counts as rest."""
_INSIDE: Final = 2e-11
"""Part of the model's size by which anything may be inside another: 1e-10 m for a model of 5 m."""
_APART: Final = 8
"""How often what is inside another is put apart after a step."""
_ROUNDED: Final = 1e-9
"""Part of a step that is rounding of the time between samples."""


# ----------------------------------------------------------------------------------------------------------------------
# The contacts of a system, and those of them that a step may meet, as rows.


@dataclass(frozen=True, eq=False)
class _Contacts:
    """The contacts of a system, m: the places of their normals among all rows and of themselves among elements.

    Of friction parts, p: the contact of each, its place among all coefficients, and the places of its rows.
    """

    laws: Laws
    scale: Scale

    @cached_property
    def _parts(self) -> list[tuple[int, str, list[int]]]:
        places, known = self.laws.places, self.laws.parts
        return [
            (k, part.name, [places[row.name] for row in part.rows])
            for k, x in enumerate(self.laws.unilateral)
            for part in x.frictions
            if part.name in known
        ]

    @cached_property
    def normals(self) -> Places:
        return self.laws.unilateral_places[0]

    @cached_property
    def elements(self) -> Places:
        return np.array([self.laws.elements[x.name] for x in self.laws.unilateral], dtype=np.intp)

    @cached_property
    def part_names(self) -> list[str]:
        return [name for _, name, _ in self._parts]

    @cached_property
    def owners(self) -> Places:
        return np.array([k for k, *_ in self._parts], dtype=np.intp)

    @cached_property
    def coefficients(self) -> Places:
        return np.array([self.laws.parts[name] for name in self.part_names], dtype=np.intp)

    @cached_property
    def boundless(self) -> Places:
        """The parts, by number, whose friction is always enough."""
        enough = {part.name for x in self.laws.unilateral for part in x.frictions if part.enough}
        return np.array([k for k, name in enumerate(self.part_names) if name in enough], dtype=np.intp)

    @cached_property
    def tangents(self) -> Places:
        """The rows of all parts, one part after the other."""
        return np.array([row for *_, rows in self._parts for row in rows], dtype=np.intp)

    @cached_property
    def begins(self) -> Places:
        """The number of the first row of each part, and how many there are."""
        return np.concatenate([[0], np.cumsum([len(rows) for *_, rows in self._parts], dtype=np.intp)]).astype(np.intp)

    def gaps(self, facts: LawValues) -> Floats:
        """Return the gap of each contact, infinite beyond the end of its face."""
        reach = -np.minimum(TOUCHING * self.scale.length, facts.known["past_ends"][self.elements])
        there = facts.known["reaches"][self.elements] >= reach
        return np.where(there, facts.known["phi"][self.normals], np.inf)

    def near(self, facts: LawValues, h: float) -> _Near:
        """Return the contacts that may close within a step of h s."""
        pattern = self.laws.patterns["matrix"]
        lengths = np.sqrt(np.bincount(pattern.rows, facts.by_mass.entries**2, minlength=pattern.shape[0]))[self.normals]
        some = lengths > 0.0
        size = np.where(some, lengths, 1.0)
        v, a = facts.known["phidot"][self.normals] / size, h * facts.known["right"][self.normals] / size
        pushed = float(np.abs(a[some]).max(initial=0.0))
        fastest = float(np.abs(v[some]).max(initial=0.0)) + pushed
        chosen = np.flatnonzero(some & (self.gaps(facts) <= _AHEAD * h * fastest * lengths))
        return _Near.of(self, chosen, pushed)


@dataclass(frozen=True, eq=False)
class _Near:
    """Some contacts (k, by number), their friction parts, and the rows of both; `pushed` is what loads do in a step.

    That is the largest speed by loads (m/s), at unit length of rows.
    """

    contacts: Places
    parts: Places
    rows: Places
    slips: Places
    read: Places
    begins: Places
    rubs: Places
    presses: Places
    pushed: float

    @staticmethod
    def of(every: _Contacts, chosen: Places, pushed: float) -> _Near:
        """Return some contacts of all."""
        number = np.full(len(every.normals), -1, dtype=np.intp)
        number[chosen] = np.arange(len(chosen))
        parts = np.flatnonzero(number[every.owners] >= 0) if len(every.owners) else np.zeros(0, dtype=np.intp)
        counts = every.begins[parts + 1] - every.begins[parts]
        slips = ranges(every.begins[parts], counts)
        rows = np.concatenate([every.normals[chosen], every.tangents[slips]])
        pattern = every.laws.patterns["matrix"]
        first = pattern.begins[rows]
        sizes = pattern.begins[rows + 1] - first
        begins = np.concatenate([[0], np.cumsum(sizes)])
        rubs = len(chosen) + np.concatenate([[0], np.cumsum(counts)])
        read, presses = ranges(first, sizes), number[every.owners[parts]]
        return _Near(chosen, parts, rows, slips, read, begins, rubs, presses, pushed)

    def at(self, facts: LawValues) -> ContactRows:
        """Return their rows at an instant."""
        pattern = facts.laws.patterns["matrix"]
        whole = (self.begins, pattern.columns[self.read], self.rubs, self.presses)
        begins, places, rubs, presses = (np.ascontiguousarray(each, dtype=np.intc) for each in whole)
        return ContactRows(begins, places, facts.by_mass.entries[self.read], rubs, presses, pattern.shape[1])


# ----------------------------------------------------------------------------------------------------------------------
# Steps.


@dataclass(eq=False)
class ContactSteps:
    """Steps of a system from contact to contact: what impulses took so far, and how many sweeps.

    `pressing` and `rubbing` are the impulses of all contacts, and of the rows of all friction parts, in the step
    before: there the next begins to seek. `normal_work` (m) and `friction_work` (p) are in J, `inside` is the deepest
    that anything got before it was put apart.
    """

    laws: Laws
    scale: Scale
    pairs: Pairing
    sweeps: int = 0
    evaluations: int = 0
    inside: float = 0.0

    def __post_init__(self) -> None:
        self.every = _Contacts(self.laws, self.scale)
        self.pressing, self.rubbing = np.zeros(len(self.every.normals)), np.zeros(len(self.every.tangents))
        self.normal_work, self.friction_work = np.zeros(len(self.every.normals)), np.zeros(len(self.every.part_names))

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy in another process has: nothing of a library of this one."""
        return {name: value for name, value in vars(self).items() if name != "_by_sweeps"}

    def at(self, t: float, q: Floats, u: Floats) -> LawValues:
        """Return the numbers of the laws at an instant."""
        self.evaluations += 1
        return self.laws.at(t, q, u, self.scale)

    def step(self, facts: LawValues, h: float) -> LawValues:
        """Return the numbers of the laws after a step of h s."""
        near = self.every.near(facts, h)
        u = self._strike(facts, near, h)
        q = self.pairs.moved(facts.q, 0.5 * h * u)
        middle = self.at(facts.t + 0.5 * h, q, u)
        u = self._press(middle, near, h)
        return self._put_apart(self.at(facts.t + h, self.pairs.moved(q, 0.5 * h * u), u), h)

    def _strike(self, facts: LawValues, near: _Near, h: float) -> Floats:
        """Return the speeds (nu,) after what would close within the step has struck."""
        count, v = len(near.contacts), facts.known["phidot"][near.rows]
        least = np.maximum(facts.known["phi"][near.rows[:count]], 0.0) / h
        if not (v[:count] < -least).any():
            return facts.u
        rows = near.at(facts)
        lengths = np.sqrt(rows.squares)
        speed = max(float((np.abs(v[:count]) / lengths[:count]).max()), near.pushed)
        if not (v[:count] < -least - _SETTLED * speed * lengths[:count]).any():
            return facts.u
        bounces = facts.known["bounces"][self.every.elements[near.contacts]]
        fast = (v[:count] < -least) & (v[:count] < -_SLOW * near.pushed * lengths[:count])
        mu = self._coefficients(facts, near, rows, v)
        for e in (bounces, np.zeros(count)):
            added = np.concatenate([np.where(fast & (e > 0.0), e * v[:count], least), np.zeros(len(v) - count)])
            x, z = self._sweep(rows, v + added, mu, np.zeros(len(v)), speed)
            change = rows.times(x)
            work = z * (v + 0.5 * change)
            if float(work.sum()) <= _SETTLED * float(np.abs(z) @ (np.abs(v) + np.abs(change))):
                break
        self._account(near, work)
        return facts.u + facts.speeds(x)

    def _press(self, facts: LawValues, near: _Near, h: float) -> Floats:
        """Return the speeds (nu,) after loads and contact forces have acted for h s."""
        count, v = len(near.contacts), facts.known["phidot"][near.rows]
        moved = facts.u + h * facts.known["free"]
        if not count:
            return moved
        rows = near.at(facts)
        pushed = v - h * facts.known["right"][near.rows]
        pushed[:count] += 2.0 * np.maximum(facts.known["phi"][near.rows[:count]], 0.0) / h
        before = np.concatenate([self.pressing[near.contacts], self.rubbing[near.slips]])
        mu = self._coefficients(facts, near, rows, v)
        x, z = self._sweep(rows, pushed, mu, before, near.pushed)
        self.pressing, self.rubbing = np.zeros(len(self.pressing)), np.zeros(len(self.rubbing))
        self.pressing[near.contacts], self.rubbing[near.slips] = z[:count], z[count:]
        self._account(near, z * (v + 0.5 * (rows.times(x) - h * facts.known["right"][near.rows])))
        return moved + facts.speeds(x)

    def _coefficients(self, facts: LawValues, near: _Near, rows: ContactRows, v: Floats) -> Floats:
        """Return the coefficient of each friction part: the static one of what does not slip, of speeds v of rows."""
        count, own = len(near.contacts), near.rubs[:-1] - len(near.contacts)
        if not len(own):
            return np.zeros(0)
        slip = np.sqrt(np.add.reduceat(v[count:] ** 2, own))
        size = np.sqrt(np.add.reduceat(rows.squares[count:], own))
        static, kinetic = facts.known["coefficients"][self.every.coefficients[near.parts]].T
        found: Floats = np.where(slip <= _SLOW * near.pushed * size, static, kinetic)
        return np.ascontiguousarray(found)

    def _sweep(
        self, rows: ContactRows, speeds: Floats, mu: Floats, z: Floats, scale: float
    ) -> tuple[Floats, Floats]:
        """Return x (n,) and the impulses (k,) that sweeps come to from impulses z, of speeds of a scale."""
        x, speeds = rows.transposed_times(z), np.ascontiguousarray(speeds)
        self.sweeps += self._by_sweeps(rows, speeds, mu, (z, x), _SETTLED * scale, _SWEEPS)
        return x, z

    @cached_property
    def _by_sweeps(self) -> Callable[..., int]:
        """The sweeps in C, or those in Python."""
        library = getattr(self.laws.compiled["laws"], "library", None)
        return sweep if library is None else partial(_native_sweep, library)

    def _account(self, near: _Near, work: Floats) -> None:
        count = len(near.contacts)
        self.normal_work[near.contacts] += work[:count]
        if len(near.parts):
            self.friction_work[near.parts] += np.add.reduceat(work[count:], near.rubs[:-1] - count)

    def _put_apart(self, facts: LawValues, h: float) -> LawValues:
        """Return the numbers where nothing is inside another, by the least change of coordinates."""
        for _ in range(_APART):
            deepest = -float(self.every.gaps(facts).min(initial=0.0))
            if not deepest > _INSIDE * self.scale.length:
                break
            self.inside = max(self.inside, deepest)
            near = self.every.near(facts, h)
            rows = near.at(facts).without_friction
            gaps = facts.known["phi"][near.rows[: rows.normals]]
            x, _ = self._sweep(rows, gaps, np.zeros(0), np.zeros(rows.normals), deepest / math.sqrt(rows.squares.max()))
            facts = self.at(facts.t, self.pairs.moved(facts.q, facts.speeds(x)), facts.u)
        return facts


def _native_sweep(
    library: ctypes.CDLL,
    rows: ContactRows,
    speeds: Floats,
    mu: Floats,
    impulses: tuple[Floats, Floats],
    settled: float,
    most: int,
) -> int:
    """Return how many sweeps `sweep` takes, in C."""
    of = (rows.begins, rows.places, rows.matrix, rows.squares, rows.rubs, rows.presses, mu)
    contacts = ContactsStruct(len(rows.presses), *(each.ctypes.data for each in of), RELAXED)
    z, x = impulses
    arrays = (ctypes.c_void_p(each.ctypes.data) for each in (speeds, x, z))
    library.mbs_sweep.restype = ctypes.c_longlong
    done: int = library.mbs_sweep(ctypes.byref(contacts), *arrays, ctypes.c_double(settled), ctypes.c_longlong(most))
    return done


# ----------------------------------------------------------------------------------------------------------------------
# A run by steps, as results read it.


_NO_FORCES: Final = (
    "a run by method moreau has impulses of steps, not forces and accelerations at an instant: choose another method"
)


class _SteppedSamples(LegSamples):
    """Samples of a run by steps."""

    @property
    def derivative(self) -> NoReturn:
        """Raise InputError: accelerations and forces are not known."""
        raise InputError(_NO_FORCES, number="M110")


@dataclass(eq=False)
class SteppedRun:
    """A run by time stepping, under way or done; see `RunInModes`. It has no legs, and locates no events."""

    ready: PreparedSystem
    problem: Problem
    steps: ContactSteps
    legs: tuple[()] = ()
    jumps: tuple[()] = ()
    events: list[dict[str, Any]] = field(default_factory=list)
    lost_at_start: float = 0.0
    stabilised: None = None
    project: bool = True

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in no mode."""
        return self.steps.laws.mechanism

    @property
    def account(self) -> EnergyAccount:
        """The work of friction (J); that of loads which the potential energy does not hold is not known: nan."""
        own = zip(self.steps.every.part_names, self.steps.friction_work.tolist(), strict=True)
        loads = math.nan if split(self.mechanism.loads)[1] else 0.0
        return EnergyAccount({name: FrictionWork(work) for name, work in own}, loads)

    @property
    def lost(self) -> Mapping[str, float]:
        """The energy (J) that normal impulses took, by contact."""
        found = zip(self.steps.laws.unilateral, self.steps.normal_work.tolist(), strict=True)
        return {x.name: -work for x, work in found if work != 0.0}

    @property
    def along(self) -> NoReturn:
        """Raise InputError: nothing is known between steps."""
        raise InputError("a run by method moreau is known at its samples only: ask for more `samples`", number="M110")

    @property
    def passed(self) -> NoReturn:
        """Raise InputError: theorems are not verified along steps."""
        raise InputError(_NO_FORCES, number="M110")

    def added(self, leaves: Sequence[Any]) -> list[tuple[float, Floats]]:
        """Return nothing: what adds up along a run is refused."""
        return []

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str:
        """Return nothing: bars without thickness are refused."""
        return ""

    def copied(self) -> NoReturn:
        """Raise InputError: neither a Stepper nor inputs that functions give take these steps."""
        message = "a Stepper, and inputs that functions give, take no method moreau: choose another method"
        raise InputError(message, number="M117")

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]:
        """Return samples, all of one part."""
        problem = self.problem
        return (_SteppedSamples(self.ready.told, problem.compiled, problem.parameters, t, q, u, problem.modes),)

    @property
    def loop(self) -> Loop:
        """The loop that takes the steps."""
        return self._loop

    def _loop(self, problem: Problem, samples: Floats) -> Iterator[Progress]:
        """Divide the time between samples into equal steps, none longer than the step that was asked for."""
        times, step = problem.times().tolist(), problem.step
        assert step is not None  # this method has no other steps
        facts, taken, shown = self.steps.at(problem.t0, problem.q0, problem.u0), 0, perf_counter()
        samples[0] = problem.x0
        for written, (begin, end) in enumerate(pairwise(times), 1):
            count = math.ceil((end - begin) / step * (1.0 - _ROUNDED))
            for number in range(1, count + 1):
                t = begin + (end - begin) * number / count
                with stage("contacts"):
                    after = self.steps.step(facts, t - facts.t)
                x = np.concatenate([after.q, after.u])
                if not np.isfinite(x).all():
                    failure = RunFailure(Status.NOT_FINITE, t, int(np.flatnonzero(~np.isfinite(x))[0]))
                    yield self._progress(written, facts, taken, failure)
                    return
                facts, taken = after, taken + 1
            samples[written] = np.concatenate([facts.q, facts.u])
            if perf_counter() - shown > SECONDS or written == len(times) - 1:
                yield self._progress(written + 1, facts, taken, None)
                shown = perf_counter()

    def _progress(self, written: int, facts: LawValues, taken: int, failure: RunFailure | None) -> Progress:
        rows = len(self.ready.told.rows)
        mean = (facts.t - self.problem.t0) / taken if taken else 0.0
        known = Statistics(
            taken, evaluations=self.steps.evaluations, mean_step=mean, removed_position=self.steps.inside,
            least_rank=rows, greatest_rank=rows,
        )  # fmt: skip
        return Progress(written, facts.t, np.concatenate([facts.q, facts.u]), known, failure)


def stepped_runs(ready: PreparedSystem, problem: Problem, code: Native) -> Callable[[], SteppedRun]:
    """Return the function that begins a run by time stepping. Raises ModelError for what that does not take."""
    laws_of = ready.laws
    assert laws_of is not None  # of a run by this method (`prepare_system`)
    laws = laws_of_runs(ready, laws_of, code)
    if laws_of.bars:
        raise refusal(f"takes no bars without thickness that points touch ({laws_of.bars[0].words})")
    if len(laws.entries["exerted"]) or len(laws.entries["coupling"]):
        raise refusal("takes no contacts and ropes that exert another force than along their rows")
    assert ready.state.posed is not None  # contacts pose their laws at the start
    assert problem.pairs is not None
    steps = partial(ContactSteps, laws, ready.state.posed.rows.scale, problem.pairs)
    return lambda: SteppedRun(ready, problem.again(), steps())
