"""A run looked at once more: work and impulses from its start, theorems, any time, limits and edges that it passes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.balance import INTEGRAL, THEOREMS, theorems_program
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.programs.quantities import angular_momentum, body_momenta, generalized_momenta, quantities
from multibody_sym.errors import InputError
from multibody_sym.mechanics.energy import kinetic_energy
from multibody_sym.mechanics.law_elements import boxes_that_touch
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import every_row
from multibody_sym.mechanics.motion import Motion, arrays, motion_of, slot_state, state_of
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import BodyFace
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.motion.integrator.flow import longest_in_modes
from multibody_sym.motion.loop.integrate import Integration, integrate
from multibody_sym.motion.loop.problem import Begun, Problem, SampleTimes
from multibody_sym.motion.prepare.records import LegSamples, ResolvedAlone, RunLabels
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, as_node, slot
from multibody_sym.scalars.numbers import floats
from multibody_sym.scalars.rank import ROUNDED, least_squares
from multibody_sym.text.parser import QUANTITIES

if TYPE_CHECKING:
    from multibody_sym.motion.switching.impact import ImpactOutcome

# ----------------------------------------------------------------------------------------------------------------------
# Stretches of a run in fine samples, and integrals over them.
#
# Between two events nothing jumps. A stretch is run once more with four places in each of many pieces, over which the
# polynomial through five places is integrated (Boole's rule at their ends).


NEVER: Final = 1e300
"""A margin that no switching function exceeds."""
LEAST, IN_MODES, PIECES = 1024, 64, 4
"""The fewest pieces of a whole run, of a stretch in one of many modes, and of a step: those of order 8 are long."""
MOST_PIECES: Final = 100_000
"""Of a stretch: a stiff run takes millions of steps, and as many samples would fill the memory."""
BESIDE: Final = 1e-12
"""The part of a stretch beside a kink that is left out: there the force is that of either side."""
_LEAST_BESIDE: Final = 1e-14
"""The least part of a time that is left out: kinks are found to rounding."""
MOST_KINKS: Final = 1000
"""Kinks of a stretch that are told apart."""
_NODES: Final = np.linspace(0.0, 1.0, 5)
_POWERS: Final = np.arange(1, 6)
_MONOMIALS: Final = np.linalg.inv(np.vander(_NODES, increasing=True))


@dataclass(frozen=True, eq=False)
class FineLeg:
    """A part of a run in one mode: its Programs, its problem, until when, in how many steps.

    It is looked at in some pieces `per_step`, in one of many modes in `fewest` at least; `near`: no step is longer than
    a piece then, so that samples lie as near to the motion as the ends of steps.
    """

    mechanism: Mechanism
    compiled: Compiled
    problem: Problem
    until: float
    steps: int
    per_step: int = PIECES
    fewest: int = IN_MODES
    near: bool = False

    @property
    def duration(self) -> float:
        """How long it lasts."""
        return self.until - self.problem.start

    @property
    def pieces(self) -> int:
        """How many pieces its steps ask for, which is even."""
        part = self.duration / self.problem.whole if self.problem.whole else 1.0
        least = math.ceil(LEAST * part) if self.mechanism.mode is None else self.fewest
        return max(least, self.per_step * self.steps) + 1 & ~1

    def fine(self, pieces: int | None = None) -> LegSamples:
        """Return evenly spaced samples, one more than four times a number of pieces.

        These are `pieces`, if any are given, and half as many as it takes steps at least.
        """
        pieces = min(pieces or self.pieces, MOST_PIECES)
        run = vars(self).pop("sampled", None)
        if run is None or len(run.t) != 4 * pieces + 1:
            run = self._run(self.until, pieces)
        if 2 * pieces < min(run.statistics.steps, MOST_PIECES):
            return self.fine(run.statistics.steps + 1 & ~1)
        vars(self).setdefault("end", (run.q_final, run.u_final))
        count = 4 * ((len(run.t) - 1) // 4) + 1
        return self.sampled(run.t[:count], run.q[:count], run.u[:count])

    def sampled(self, t: Floats, q: Floats, u: Floats) -> LegSamples:
        """Return samples at times t (m,) in its mode, of q (m, nq) and u (m, nu)."""
        given = self.problem
        labels = RunLabels(ResolvedAlone(self.mechanism))
        return LegSamples(labels, self.compiled, given.parameters, t, q, u, given.modes)

    @cached_property
    def end(self) -> tuple[Floats, Floats]:
        """The state q, u that it reaches, which fine samples find as well."""
        return self.at(self.until, 1)

    def _run(self, until: float, pieces: int) -> Integration:
        """Run until a time with four samples in each piece, and one."""
        return self._to(until, 4 * pieces + 1, pieces if self.near else self.fewest)

    def _to(self, until: float, samples: int, steps: int) -> Integration:
        """Run from the beginning until a time once more, whatever the mode's switching functions say.

        No step is longer than one of `steps` evenly spaced ones.
        """
        problem = self.problem
        part = longest_in_modes(1.0, problem.rates(problem.start, problem.x0))
        whole = min(problem.lasts, (until - problem.start) / (steps * part))
        problem = replace(problem, t0=problem.start, t_end=until, samples=samples, begun=None, whole=whole)
        return integrate(replace(problem, margins=(NEVER,) * len(problem.margins), limiting=()))

    def at(self, time: float, steps: int = IN_MODES) -> tuple[Floats, Floats]:
        """Return q and u that it reaches at a time in at least some steps, those at its beginning for one before."""
        if time <= self.problem.start:
            return self.problem.q0, self.problem.u0
        reached = self._to(time, 2, steps)
        return reached.q_final, reached.u_final

    def part(self, begin: float, until: float, q: Floats, u: Floats) -> FineLeg:
        """Return the part of it that begins with a state, with its share of the steps."""
        steps = math.ceil(self.steps * (until - begin) / self.duration)
        problem = replace(self.problem, t0=begin, q0=q, u0=u, begun=None)
        return replace(self, problem=problem, until=until, steps=max(1, steps))

    def halves(self) -> list[FineLeg]:
        """Return both halves, or itself if no time lies between its ends."""
        start, middle = self.problem.start, self.until - self.duration / 2
        if not start < middle < self.until:
            return [self]
        first = replace(self, until=middle, steps=max(1, self.steps // 2))
        return [first, self.part(middle, self.until, *self.at(middle))]

    def smooth_parts(self, pieces: int | None = None) -> Iterator[FineLeg]:
        """Yield the parts between kinks, at which forces bend or jump; they end and begin just beside them.

        A kink may end a mode: then the last one ends just before it. Without kinks it is that one itself, of which
        samples in `pieces` are known then.
        """
        problem = self.problem
        if all(problem.terminal[: problem.switches]):
            yield self
            return
        beside, rest, end = max(BESIDE * self.duration, _LEAST_BESIDE * abs(self.until)), self, self.until
        run = self._run(end + beside, min(pieces or self.pieces, MOST_PIECES))
        kinks = [event.time for event in run.events if not event.terminal]
        if not kinks:
            vars(self)["sampled"] = run  # of which the last one is behind the end by rounding
        for time in kinks if len(kinks) <= MOST_KINKS else ():
            before, after = time - beside, time + beside
            if before <= rest.problem.start:
                continue
            if after >= end:
                end = before
                break
            part = rest.part(rest.problem.start, before, rest.problem.q0, rest.problem.u0)
            yield part
            across = self.part(before, after, *part.end)
            rest = self.part(after, end, *across.end)
        yield rest if end == self.until else rest.part(rest.problem.start, end, rest.problem.q0, rest.problem.u0)


def integral(values: Floats, t: Floats) -> Floats:
    """Return the integrals (pieces + 1, ...) of values (4 pieces + 1, ...) from the first time to the end of pieces."""
    pieces = (len(t) - 1) // 4
    weights = integral_weights(1.0)
    of_piece = sum(weights[k] * values[k : 4 * pieces + k : 4] for k in range(4)) if pieces else values[:0]
    of_piece = of_piece + weights[4] * values[4 : 4 * pieces + 1 : 4] if pieces else of_piece
    lengths = (t[4::4] - t[:-4:4]).reshape(-1, *(1,) * (values.ndim - 1))
    found: Floats = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(of_piece * lengths, axis=0)])
    return found


def integral_weights(part: float) -> Floats:
    """Return the weights (5) of a piece's values in the integral over its first part."""
    found: Floats = (part**_POWERS / _POWERS) @ _MONOMIALS
    return found


def integral_until(times: Floats, values: Floats, t: Floats) -> Floats:
    """Return the integrals (times, ...) of values at t (4 pieces + 1) from the first of t until each of some times."""
    found = np.zeros((len(times), *values.shape[1:]))
    whole, ends = integral(values, t), t[::4]
    for k, time in enumerate(times):
        piece = int(np.clip(np.searchsorted(ends, time, side="right") - 1, 0, max(len(ends) - 2, 0)))
        found[k] = whole[piece]
        if len(ends) > 1:
            length = ends[piece + 1] - ends[piece]
            weights = integral_weights(float(np.clip((time - ends[piece]) / length, 0.0, 1.0))) * length
            found[k] += np.tensordot(weights, values[4 * piece : 4 * piece + 5], axes=1)
    return found


def with_program(
    stretches: Sequence[FineLeg], name: str, make: Callable[[Mechanism], Program]
) -> Iterator[tuple[FineLeg, Compiled]]:
    """Yield what lasts of stretches with the Program `name`: one of its own, or made of the mechanism of each."""
    programs: dict[int, Compiled] = {}
    for stretch in stretches:
        if stretch.duration <= 0.0:
            continue
        key = id(stretch.mechanism)
        if key not in programs:
            own = stretch.compiled
            programs[key] = own if name in own else load({name: make(stretch.mechanism)}, own.likewise)
        yield stretch, programs[key]


@dataclass(frozen=True, eq=False)
class Adding:
    """The expressions of `asked` outputs, and which of their leaves add up."""

    asked: Mapping[str, Node]

    @property
    def leaves(self) -> list[Node]:
        """What adds up: work and impulses."""
        found = dict.fromkeys(leaves(self.asked.values(), "quantity"))
        return [leaf for leaf in found if leaf.data[0] in QUANTITIES and QUANTITIES[leaf.data[0]].of_run]

    def rates(self, mechanism: Mechanism) -> Program:
        """Return (t, q, u, ..., udot (nu), multipliers (ns)) -> values (leaves): powers and forces."""
        trace = _trace("rates", mechanism)
        motion = motion_of(mechanism, slot_state(mechanism))
        found = quantities(motion, trace["udot"], trace["multipliers"], self.leaves)
        return trace.finish({"values": ((len(found),), [as_node(x) for x in found.values()])})

    def outputs(self, mechanism: Mechanism) -> Program:
        """Return (t, q, u, ..., udot (nu), multipliers (ns), sums (leaves)) -> values (asked)."""
        sums = self.leaves
        trace = _trace("run_outputs", mechanism, Array("sums", (len(sums),)))
        others = [leaf for leaf in leaves(self.asked.values(), "quantity") if leaf not in sums]
        motion = motion_of(mechanism, slot_state(mechanism))
        found = quantities(motion, trace["udot"], trace["multipliers"], others)
        known = {**found, **dict(zip(sums, trace["sums"], strict=True))}
        values = evaluate(self.asked.values(), lambda leaf: known.get(leaf, leaf))
        return trace.finish({"values": ((len(values),), [as_node(x) for x in values])})


def _trace(name: str, mechanism: Mechanism, *more: Array) -> Trace:
    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    return Trace(name, (*arrays(mechanism), *unknown, *more))


def integrated_outputs(
    adding: Adding,
    stretches: Sequence[FineLeg],
    parts: Sequence[LegSamples],
    jumps: Iterable[tuple[float, Floats]] = (),
) -> dict[str, Floats]:
    """Return outputs at the samples of a run's parts (m,), which are in the modes of its stretches.

    `jumps` are the times of impacts, and what each adds to the leaves; a sample at that time comes after it.
    """
    count = len(adding.leaves)
    times = np.concatenate([part.t for part in parts]) if parts else np.zeros(0)
    sums = np.zeros((len(times), count))
    for stretch, program in with_program(stretches, "rates", adding.rates):
        for smooth in stretch.smooth_parts():
            fine = smooth.fine()
            (values,) = program.map("rates", *fine.arguments, *fine.derivative[1:3])
            within = np.clip(times, fine.t[0], fine.t[-1])
            sums += integral_until(within, values, fine.t)
    for time, more in jumps:
        sums[times >= time] += more
    found, first = [], 0
    for part in parts:
        own = sums[first : first + len(part.t)]
        first += len(part.t)
        program = load({"run_outputs": adding.outputs(part.mechanism)}, part.compiled.likewise)
        (values,) = program.map("run_outputs", *part.arguments, *part.derivative[1:3], own)
        found.append(values)
    columns = np.concatenate(found) if found else np.zeros((0, len(adding.asked)))
    return dict(zip(adding.asked, columns.T, strict=True))


# ----------------------------------------------------------------------------------------------------------------------
# The general theorems through impacts: what the impulses of all rows make of momenta and energy.
#
#     P+ - P- = sum of impulses,   L+ - L- = sum of their moments,   T+ - T- = b du - what was lost - sum z_k dphi_k/dt
#
# The right sides come from the impulses z of the rows that struck: M du = C^T z gives the speeds that they lead to, by
# composite bodies, where the run went on from those of its law solver in weighted coordinates. What moves as
# prescribed does work too: with b = dT/du at u = 0, the momenta that it gives, and the rates dphi/dt that it gives the
# rows.


@dataclass(frozen=True, eq=False)
class ImpactBalance:
    """An impact at time t, of P, L about the origin and T (7): how they `changed`, and how they should have.

    `expected` follows from the impulses, `size` is the sum of absolute terms before, after and of what changed them.
    """

    t: float
    changed: Floats
    expected: Floats
    size: Floats


def impact_balance(mechanism: Mechanism, blow: ImpactOutcome) -> ImpactBalance:
    """Return both sides of the theorems at an impact."""
    struck = tuple(row for row in every_row(mechanism) if blow.rows.get(row.name))
    before = _motion(replace(mechanism, rows=struck), blow, blow.u)
    rows, z = row_motions(before), [blow.rows[row.name] for row in struck]
    forces = np.array([row.forces for row in rows], dtype=float).reshape(len(rows), len(blow.u))
    led = blow.u + least_squares(np.array(mass_matrix(before), dtype=float), forces.T @ np.array(z), ROUNDED)
    after, reached = (_motion(mechanism, blow, u) for u in (blow.u + blow.jump, led))
    (m0, size0), (m1, size1), (m2, _) = (_momenta(motion) for motion in (before, after, reached))
    T0, T1 = (float(kinetic_energy(motion)) for motion in (before, after))
    prescribed = generalized_momenta(_motion(mechanism, blow, np.zeros_like(blow.u)))
    given = [float(b * du) for b, du in zip(prescribed, blow.jump.tolist(), strict=True)]
    given += [-x * _drive(row, blow.u) for x, row in zip(z, rows, strict=True)]
    lost = sum(blow.lost.values())
    energy = T0 + T1 + abs(lost) + sum(map(abs, given))
    return ImpactBalance(
        blow.t,
        np.array([*(m1 - m0), T1 - T0]),
        np.array([*(m2 - m0), sum(given) - lost]),
        np.array([*(size0 + size1), energy]),
    )


def impact_integrals(mechanism: Mechanism, blow: ImpactOutcome, leaves: Sequence[Node]) -> Floats:
    """Return what an impact adds to work and impulses (leaves).

    Forces are linear in accelerations and multipliers: du and the impulses in their place give impulses, and work at
    the mean of the speeds before and after (Thomson and Tait). Of several impacts in turn, each element has lost what
    the laws tell; the mean of all speeds shares the same sum otherwise.
    """
    whole = replace(mechanism, rows=every_row(mechanism))
    mean = _motion(whole, blow, blow.u + blow.jump / 2.0)
    z = [blow.rows.get(row.name, 0.0) for row in whole.rows]
    struck = quantities(mean, blow.jump.tolist(), z, leaves)
    beside = quantities(mean, [0.0] * len(blow.u), [0.0] * len(z), leaves)
    mended = _lost_in_turn(whole, mean, blow, z)
    work = [mended.get(leaf.data[1][0], 0.0) if leaf.data[0] == "work" else 0.0 for leaf in leaves]
    found: Floats = np.array([float(struck[leaf] - beside[leaf]) for leaf in leaves]) + np.array(work)
    return found


def _lost_in_turn(whole: Mechanism, mean: Motion, blow: ImpactOutcome, z: Sequence[float]) -> dict[str, float]:
    """Return by how much the work of what is declared, by name, differs from that at the mean of all speeds (J)."""
    rows = row_motions(mean)
    taken = {
        row.name: x * (float(np.array(own.forces, dtype=float) @ mean.state.u) + _drive(own, np.array(mean.state.u)))
        for row, own, x in zip(whole.rows, rows, z, strict=True)
        if x
    }
    found: dict[str, float] = {}
    for element in whole.one_way:
        if element.name in blow.lost:
            off = -blow.lost[element.name] - sum(taken.get(row.name, 0.0) for row in element.rows)
            found[element.path[1]] = found.get(element.path[1], 0.0) + off
    return found


def _motion(mechanism: Mechanism, blow: ImpactOutcome, u: Floats) -> Motion:
    given = blow.t, blow.q.tolist(), u.tolist(), blow.parameters.tolist()
    return motion_of(mechanism, state_of(mechanism, float, *given))


def _momenta(motion: Motion) -> tuple[Floats, Floats]:
    """Return P and L about the origin (6), and the sums of the lengths of their terms."""
    parts = body_momenta(motion)
    values = [[*part.momentum, *angular_momentum([part])] for part in parts]
    linear, spin, com = (
        np.linalg.norm(np.array([getattr(part, of) for part in parts], dtype=float).reshape(-1, 3), axis=1)
        for of in ("momentum", "spin", "com")
    )
    angular = spin + com * linear
    sizes = np.repeat([linear.sum(), angular.sum()], 3)
    return np.array(values, dtype=float).reshape(-1, 6).sum(axis=0), sizes


def _drive(row: RowMotion, u: Floats) -> float:
    """Return the rate of a row that time alone gives it; none of friction in joints, all whose work counts as lost."""
    if row.exerts is not None or not row.kinematic:
        return 0.0
    return float(row.phidot) - float(np.array(row.jacobian, dtype=float) @ u)


# ----------------------------------------------------------------------------------------------------------------------
# How well the general theorems hold along a run, in differential and in integral form.
#
# In each state rates are compared with their causes; from the start of the run on the changes of momentum, angular
# momentum and kinetic energy with the impulses of all forces and their work, those of impacts too. What is missed is
# told beside the sum of absolute values of the terms, with the time. Each impact is looked at by itself as well.


_FINER: Final = 4
"""How many times as fine a stretch is looked at where its integrals are not settled, twice at most."""
_SETTLED: Final = 1e-10
"""Relative change of integrals by half as many places up to which they are settled: Boole's rule is 64 times nearer."""


_MOST_HALVINGS: Final = 40
"""How often a run's stretches are halved in all, where places too far apart could make a miss."""


@dataclass(frozen=True)
class Miss:
    """By how much a theorem is missed at worst, relative to the sum of absolute terms, and at which time."""

    relative: float
    t: float


@dataclass
class _Since:
    """Values (7) at the start of a run, and what impulses and work have been since, with the sums of absolute terms."""

    start: Floats | None = None
    content: Floats = field(default_factory=lambda: np.zeros(7))
    total: Floats = field(default_factory=lambda: np.zeros(7))
    size: Floats = field(default_factory=lambda: np.zeros(7))
    halvings: int = 0


def theorem_misses(stretches: Sequence[FineLeg], jumps: Iterable[ImpactBalance] = ()) -> dict[str, Miss]:
    """Return the largest miss of each theorem along a run, by name: three at each instant, three as integrals.

    `jumps` are the impacts of the run in the order of time, which come before the stretches that begin then.
    """
    worst = {name: Miss(0.0, 0.0) for name in (*THEOREMS, *INTEGRAL.values())}
    for name, miss in _misses(stretches, iter(jumps)):
        if not miss.relative <= worst[name].relative:
            worst[name] = miss
    return worst


def _misses(stretches: Sequence[FineLeg], jumps: Iterator[ImpactBalance]) -> Iterator[tuple[str, Miss]]:
    since, waiting = _Since(), next(jumps, None)
    for stretch, program in with_program(stretches, "theorems", theorems_program):
        while waiting is not None and waiting.t <= stretch.problem.start:
            yield from _of_jump(waiting, since)
            waiting = next(jumps, None)
        for part in stretch.smooth_parts():
            yield from _of_stretch(part, program, since)
    for jump in (waiting, *jumps):
        if jump is not None:
            yield from _of_jump(jump, since)


def _of_jump(jump: ImpactBalance, since: _Since) -> Iterator[tuple[str, Miss]]:
    if since.start is not None:
        since.total, since.size = since.total + jump.expected, since.size + jump.size
    for name, own in THEOREMS.items():
        missed = (jump.changed - jump.expected)[None, own]
        yield INTEGRAL[name], _worst(missed, jump.size[None, own], np.array([jump.t]))


def _of_stretch(stretch: FineLeg, program: Compiled, since: _Since) -> Iterator[tuple[str, Miss]]:
    finer = 1
    while True:
        fine = stretch.fine(finer * stretch.pieces)
        value, left, right, size, content = program.map("theorems", *fine.arguments, *fine.derivative[1:3])
        adding, scales = integral(right, fine.t), integral(size, fine.t)
        finest = finer >= _FINER**2 or len(fine.t) > 4 * MOST_PIECES
        if finest or _is_settled(right, scales[-1] + content[-1] + content[0], adding[-1], fine.t):
            break
        finer *= _FINER
    if since.start is None:
        since.start, since.content = value[0], content[0]
    ends = slice(None, None, 4)
    missed = value[ends] - since.start - (since.total + adding)
    # Between the ends of a step samples are as near as it is long; what began at rest is next to nothing at first:
    # each time has the sizes of that a mean step later, at most the last.
    count = len(scales)
    a_step_on = np.minimum(np.arange(count) + math.ceil(count / max(stretch.steps, 1)), count - 1)
    whole = (since.size + scales + content[ends] + since.content)[a_step_on]
    if since.halvings < _MOST_HALVINGS and _is_doubtful(missed, whole, right, adding, fine.t):
        since.halvings += 1
        for half in stretch.halves():
            yield from _of_stretch(half, program, since)
        return
    for name, own in THEOREMS.items():
        yield name, _worst(left[:, own] - right[:, own], (size + content)[:, own], fine.t)
        yield INTEGRAL[name], _worst(missed[:, own], whole[:, own], fine.t[ends])
    since.total, since.size = since.total + adding[-1], since.size + scales[-1]


def _is_settled(values: Floats, size: Floats, found: Floats, t: Floats) -> bool:
    """Return whether half as many places give the same integrals (7), beside the terms' size."""
    count = 8 * ((len(t) - 1) // 8) + 1
    if count < len(t):
        return True  # a sample is missing at the end: there is nothing to compare with
    changed = np.abs(integral(values[::2], t[::2])[-1] - found)
    return bool(np.all(changed <= _SETTLED * size))


def _is_doubtful(missed: Floats, whole: Floats, values: Floats, found: Floats, t: Floats) -> bool:
    """Return whether the largest miss of an integral (7) may be one of its places: half as many change it by as much.

    What dies out soon after the start of a long stretch is not seen by integrals over all of it.
    """
    for own in THEOREMS.values():
        most, of = np.abs(missed[::2, own]).max(axis=1), whole[::2, own].max(axis=1)
        rates = np.divide(most, of, out=np.zeros(len(most)), where=of > 0.0)
        k = int(np.argmax(rates))
        changed = np.abs(integral(values[::2, own], t[::2])[: len(most)] - found[: 2 * len(most) : 2, own])
        if rates[k] > _SETTLED and k < len(changed) and changed[k].max() >= most[k]:
            return True
    return False


def _worst(missed: Floats, size: Floats, t: Floats) -> Miss:
    """Return the largest of |missed| (times, components) beside the largest component's size; 0/0 is 0."""
    most, of = np.abs(missed).max(axis=1), size.max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(most == 0.0, 0.0, most / of)
    k = int(np.argmax(np.where(np.isnan(relative), np.inf, relative)))
    return Miss(float(relative[k]), float(t[k]))

# ----------------------------------------------------------------------------------------------------------------------
# A run at any time: between its samples as the method's continuous extension tells, at events on either side.


_ROUNDED: Final = 1e-14
"""The part of a run's time by which a time may be beyond its end."""


def motion_at(legs: Sequence[FineLeg], until: float, t: ArrayLike, *, before: bool) -> list[LegSamples]:
    """Return the motion of a run, which lasts `until` a time, at times (m,), `before` or after events that are there.

    Raises InputError for times that do not increase, or are outside of the run.
    """
    start, given = legs[0].problem.start, np.atleast_1d(floats("t", t))
    if given.ndim != 1 or not len(given):
        raise InputError(f"a run is asked at a time or at a list of times, not at an array of shape {np.shape(t)}")
    outside = ~((given >= start) & (given <= until + _ROUNDED * abs(until)))
    if outside.any():
        raise InputError(f"t = {given[outside][0]:g} is outside of the run, which lasts from {start:g} to {until:g} s")
    if not np.all(np.diff(given) > 0.0):
        raise InputError("the times at which a run is asked increase")
    times = np.minimum(given, until)
    starts = np.array([leg.problem.start for leg in legs])
    places = np.searchsorted(starts, times, side="left" if before else "right") - 1
    places = places.clip(0, len(legs) - 1)
    return [_leg_at(legs[k], times[places == k]) for k in np.unique(places).tolist()]


def _leg_at(leg: FineLeg, times: Floats) -> LegSamples:
    """Return the motion at times of a leg, which is integrated once more in its own steps."""
    problem, nq = leg.problem, len(leg.problem.q0)
    start, until = problem.start, leg.until
    x = np.tile(problem.x0, (len(times), 1))
    if until > start:
        between = (times > start) & (times < until)
        samples = SampleTimes((start, *times[between].tolist(), until))
        begun = None if problem.begun is None else Begun(start, 1)
        again = replace(problem, t_end=until, samples=samples, begun=begun, limiting=())
        done = integrate(replace(again, margins=(NEVER,) * len(problem.margins)))
        x[times > start] = np.concatenate([done.q_final, done.u_final])
        x[np.flatnonzero(between)[: len(done.t) - 1]] = np.hstack([done.q, done.u])[1 : 1 + between.sum()]
    return leg.sampled(times, x[:, :nq], x[:, nq:])

# ----------------------------------------------------------------------------------------------------------------------
# What a motion passes, and when: limits of joints, edges of boxes.


ERROR_OF_A_RUN: Final = 1e-9
"""How far beyond a limit a motion that rests there may be found."""


class PassedLimit(NamedTuple):
    """A limit (`lower`, `upper` or `velocity`) of a joint, `bound` in its SI unit, passed first at a sample."""

    joint: str
    limit: str
    bound: float
    unit: str
    sample: int


def limits_passed(
    mechanism: Mechanism, parameters: Sequence[float] | Floats, samples: Callable[[str], Floats]
) -> list[PassedLimit]:
    """Return the limits that a motion passes; `samples` gives those (m,) of a coordinate or speed by name."""
    units = MechanismUnits(mechanism).state
    values = {slot("parameters", i): float(x) for i, x in enumerate(parameters)}
    found = []
    for limit in mechanism.limits:
        position, speed = samples(limit.coordinate), np.abs(samples(limit.speed))
        sides = (("lower", limit.lower, position, -1), ("upper", limit.upper, position, 1))
        for name, declared, size, side in (*sides, ("velocity", limit.velocity, speed, 1)):
            unit = units[limit.coordinate if size is position else limit.speed]
            if declared is not None:
                bound = evaluate_float([declared], values)[0]
                beyond = np.flatnonzero(side * (size - bound) > ERROR_OF_A_RUN)
                found += [PassedLimit(limit.joint, name, bound, unit, int(k)) for k in beyond[:1]]
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Boxes in space whose edges pass into each other in a run: their corners touch faces, edges only what is declared.


_MOST: Final = 200
"""At how many samples it is looked, evenly spaced: each takes the places of all bodies anew."""
_DEPTH: Final = 1e-6
"""The part of a box by which an edge of another one is in it more than by the rounding of what touches."""
_ALONG: Final = ((1, 2), (0, 2), (0, 1))


def crossed_boxes(mechanism: Mechanism, parameters: Floats, t: Floats, q: Floats, u: Floats) -> dict[str, float]:
    """Return for each contact of two boxes the time of the first sample in which an edge leads through the other box.

    Both ends of the edge are outside, so that no corner tells.
    """
    pairs = boxes_that_touch(mechanism.one_way)
    found: dict[str, float] = {}
    for k in np.unique(np.linspace(0, len(t) - 1, min(len(t), _MOST)).astype(int)).tolist() if pairs else ():
        given = float(t[k]), q[k].tolist(), u[k].tolist(), parameters.tolist()
        motion = motion_of(mechanism, state_of(mechanism, float, *given))
        for name, faces in pairs.items():
            if name in found:
                continue
            first, second = (_Box.of(motion, sides) for sides in faces)
            if first.depth(second.edges()) > _DEPTH or second.depth(first.edges()) > _DEPTH:
                found[name] = given[0]
    return found


@dataclass(frozen=True)
class _Box:
    """A box in world axes: its `centre` (3,), and the ways from there to three faces, `halves` (3, 3)."""

    centre: Floats
    halves: Floats

    @classmethod
    def of(cls, motion: Motion, faces: Sequence[BodyFace]) -> _Box:
        """Return the box between six faces."""
        middles = np.array([position(motion, face.place) for face in faces], dtype=float)
        ways = middles - middles.mean(axis=0)
        halves: list[Floats] = []
        for way in ways:
            if all(abs(way @ other) <= 0.5 * (way @ way) for other in halves):
                halves.append(way)
        return cls(middles.mean(axis=0), np.array(halves))

    def edges(self) -> Floats:
        """Return the ends of the twelve edges (12, 2, 3)."""
        return np.array(
            [
                [self.centre + s * self.halves[b] + t * self.halves[c] + end * self.halves[a] for end in (-1.0, 1.0)]
                for a, (b, c) in enumerate(_ALONG)
                for s, t in product((-1.0, 1.0), repeat=2)
            ]
        )

    def depth(self, edges: Floats) -> float:
        """Return how deep the deepest of edges (n, 2, 3) leads through, relative to the box; 0 where none does."""
        scaled = (edges - self.centre) @ (self.halves / (self.halves**2).sum(axis=1)[:, None]).T
        before, whole = scaled[:, 0], scaled[:, 1] - scaled[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = np.stack([(-1.0 - before) / whole, (1.0 - before) / whole])
        still, inside = np.abs(whole) < _DEPTH, np.abs(before) < 1.0
        first = np.where(still, np.where(inside, 0.0, 1.0), crossed.min(axis=0)).max(axis=1)
        last = np.where(still, np.where(inside, 1.0, 0.0), crossed.max(axis=0)).min(axis=1)
        middle = before + ((first + last) / 2)[:, None] * whole
        leads = (first > 0.0) & (last < 1.0) & (first < last)
        return float((1.0 - np.abs(middle).max(axis=1))[leads].max(initial=0.0))
