"""The state just beyond where sliding friction jams: its push grows without bound as it hardly moves what it presses.

On the way there (Painleve's paradox) speeds change as the square root of the time that is left. With the reciprocal m
of the push, dx = f m ds and dt = m ds, all is smooth, and m passes zero at some pace: so the state there is found from
any step before. Where a push grows as constraints come to depend on each other, m only fades. So it does where what
slides at a speed v is slowed down on the way, by c/m: with dm = -k v dt, v dv = (c/k) dm/m. Then v has vanished before
m has, and as m fades exponentially with what v^2 loses, next to no time passes: an impact stops the slip.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.mechanics.motion import state_of
from multibody_sym.motion.loop.integrate import runge_kutta_step
from multibody_sym.motion.switching.impact import ImpactOutcome
from multibody_sym.motion.switching.law_values import LawValues
from multibody_sym.motion.switching.legs import ModeLeg
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import most, pressing
from multibody_sym.scalars.rank import least_squares

_FIRST: Final = 1e-9
"""The part of the largest speeds by which a first step changes them, ..."""
_FARTHEST: Final = 1e-2
"""... and of a last one, each of which is twice as long as the one before."""
_BEYOND: Final = 1e-6
"""By how much they are changed from where m is zero to the state beyond."""
_SLOWEST: Final = 1e-8
"""The part of the largest speeds below which slip counts as being at rest."""
_SOON: Final = 1e-3
"""The part of the time in which the fastest passes the model's size within which a jam is near."""
_JAMS: Final = 1e-3
"""The part of what rows push without friction below which friction leaves next to nothing of it."""

_BACK: Final = 1e-8
"""The part of that time before a jam at which slip that it stops is stopped: the state there is known well."""
_AT_ONCE: Final = 1e-5
"""The part of it in which the slip stops if m fades."""
_STEPS: Final = 1000
"""The most steps on the way there."""
_FADED: Final = 1e-5
"""The part of m there below which it has faded."""
_ROUNDED: Final = 1e-12
"""The part of a step up to which slip stops."""

_ITSELF: Final = 0.1
"""The part of what presses that friction may leave to others where it makes it itself."""


@dataclass(frozen=True, eq=False)
class Jam:
    """What jams, a row by name, and what holds just beyond."""

    row: str
    facts: LawValues


def jam_of(now: ModeLeg, facts: LawValues) -> Jam | None:
    """Return where what slides jams soon after an instant of a mode; None if nothing does."""
    way = _way_from(now, facts)
    if way is None:
        return None
    with np.errstate(all="ignore"):
        there = way.beyond(_state(facts))
    if there is None or not there[0] - facts.t <= _SOON * facts.scale.time:
        return None
    q, u = np.split(there[1:], [len(facts.q)])
    time = max(facts.t, float(there[0]))  # from where m is zero on the way leads back in time
    return Jam(now.program.mechanism.rows[way.row].name, facts.laws.at(time, q, u, facts.scale))


def _way_from(now: ModeLeg, facts: LawValues) -> _Way | None:
    """Return the way in s from an instant of a mode on, by what slides and pushes most; None where nothing does."""
    rows = now.program.mechanism.rows
    _, pushes, _ = now.of.pushed(facts.t, _state(facts)[1:])
    slides = {row.name: row for row in now.program.entered.rows if row.sliding}
    sliding = [k for k, row in enumerate(rows) if row.name in slides]
    if not sliding or not np.isfinite(pushes).all():
        return None
    row = max(sliding, key=lambda k: abs(float(pushes[k])))
    if not pushes[row]:
        return None
    # No step may lead far beyond where slip stops: its speed, as a part of the largest speeds.
    frictions = slides[rows[row].name].sliding
    along = [each for friction in frictions for each in friction.rows if each.name in facts.laws.places]
    parts = [abs(facts.phidot(each)) / size for each in along if (size := facts.allowed_speed(each, 1.0)) > 0.0]
    slip = min(1.0, max(_SLOWEST, *parts)) if parts else 1.0
    return _Way(now, row, float(pushes[row]), slip * facts.sizes[-len(facts.u) :])


def _state(facts: LawValues) -> Floats:
    """Return y = t, q, u (1 + nq + nu,)."""
    return np.concatenate([[facts.t], facts.q, facts.u])


def jams(now: ModeLeg, t: float, x: Floats) -> bool:
    """Return whether friction, and not what restricts positions, takes next to all of what rows push at a state."""
    from multibody_sym.dynamics.redundancy import nearly_dependent  # which few runs need

    mechanism, parameters = now.program.entered, now.parameters
    if not any(row.sliding for row in mechanism.rows):
        return False
    q, u = np.split(x, [len(now.of.q0)])
    state = state_of(mechanism, float, t, q.tolist(), u.tolist(), parameters)
    generic = mechanism.parameters.independent_rows(parameters)
    if not generic:  # what rows would hold is held anyway
        return False
    *_, left = now.of.pushed(t, x)
    return left < _JAMS * nearly_dependent(composite_body(mechanism, state), generic).independence ** 2


def before_jam(now: ModeLeg, facts: LawValues) -> float | None:
    """Return a time up to an instant near which what slides jams, so long before that times can be told apart.

    None where nothing does, or in a mode of Programs of its own, without multipliers of friction.
    """
    way = _way_from(now, facts) if now.program.mechanism.mode_numbers else None
    return None if way is None else way.before(_state(facts), _BACK * facts.scale.time)


def slip_stopped(now: ModeLeg, facts: LawValues) -> ImpactOutcome | None:
    """Return the impact in which slip stops where m, from an instant of a mode on, only fades; None if it does not."""
    way = _way_from(now, facts)
    posed = facts.posed([x.name for x in facts.laws.unilateral if x.name in now.active])
    rows = [part.rows for part in posed.parts if now.mode.slip(part)]
    slides = [each[0].name for each in rows]
    if way is None or any(len(each) > 1 for each in rows):  # slip turns in space
        return None
    stopped = way.stopped(facts, slides)
    if stopped is None or stopped[0][0] - facts.t > _AT_ONCE * facts.scale.time:
        return None
    after, pushed, took = stopped
    lost = dict(zip(slides, took.tolist(), strict=True))
    names = [row.name for row in now.program.mechanism.rows]
    impulses = dict.fromkeys(posed.names, 0.0) | dict(zip(names, pushed.tolist(), strict=True))
    return ImpactOutcome(
        after[1 + len(facts.q) :] - facts.u,
        {x.name: impulses[x.normals[0].name] for x in posed.elements if x.unilateral},
        {x.name: sum(lost.get(row.name, 0.0) for row in x.rows) for x in posed.elements},
        facts.t,
        facts.q,
        facts.u,
        {name: impulses[name] for name in posed.names},
        facts.laws.parameters,
    )


def feeds_itself(now: ModeLeg, facts: LawValues) -> str | None:
    """Return the name of a part whose friction makes nearly all of what presses it, as bodies are massless; or None.

    What presses follows from the motion that friction makes while rows hold.
    """
    posed = facts.posed([name for name in now.active if any(x.name == name for x in facts.laws.unilateral)])
    problem, rows = posed.problem, [row.name for row in now.program.entered.rows if row.name in posed.places]
    held = [posed.places[name] for name in rows if not problem.coupling[posed.places[name]].any()]
    for part, law in zip(posed.parts, problem.parts, strict=True):
        if law.rests or len(law.rows) > 1:
            continue
        moved = problem.exerted[law.rows[0]]
        forces = least_squares(problem.matrix[held] @ problem.exerted[held].T, problem.matrix[held] @ moved)
        normal = problem.matrix[list(law.normals)] @ (moved - problem.exerted[held].T @ forces)
        made = most(law.kinetic, pressing(normal.tolist(), [0] * len(normal), norm=law.norm))
        if abs(made - 1.0) < _ITSELF:
            return part.name
    return None


@dataclass(frozen=True, eq=False)
class _Way:
    """The way in s of time and state y (1 + nq + nu,) in a mode; m is 1 where the `row` has this `push`.

    `sizes` (nu,) are the largest speeds, or as small as the slip is beside them.
    """

    now: ModeLeg
    row: int
    push: float
    sizes: Floats

    def beyond(self, y: Floats) -> Floats | None:
        """Return y where m has just changed its sign; None where it does not, or nothing moves."""
        part, m = _FIRST, 1.0
        if not math.isfinite(self.pace(y)):
            return None
        while part < _FARTHEST:
            step = part * self.pace(y)
            ahead = self.step(y, step)
            found = self.slope(ahead)[1]
            if not np.isfinite(found):
                return None
            if found <= 0.0:
                return self.step(y, step * m / (m - found) + _BEYOND * self.pace(y))
            part, y, m = 2.0 * part, ahead, found
        return None

    def before(self, y: Floats, time: float) -> float | None:
        """Return a time up to some `time` (s) before y, within the mode; None where steps do not lead so far back."""
        begun = float(y[0])
        for _ in range(_STEPS):
            pace = self.pace(y)
            if not math.isfinite(pace):
                return None
            ago = self.step(y, -_FARTHEST * pace)
            if begun - float(ago[0]) > time or ago[0] < self.now.start:
                return float(y[0])
            y = ago
        return None

    def stopped(self, facts: LawValues, slides: Sequence[str]) -> tuple[Floats, Floats, Floats] | None:
        """Return y where the first of the rows that `slides` stops, impulses (rows), and what slip took (J); or None.

        Once m has faded rounding decides what is left of it, and the way goes straight on.
        """
        from scipy.optimize import brentq  # takes long to import

        y, nq = _state(facts), len(facts.q)
        names, ny = [row.name for row in self.now.program.mechanism.rows], len(y)
        pushing, places = [names.index(name) for name in slides], [facts.laws.places[name] for name in slides]
        jacobian, begun, straight = facts.by_speeds[places], facts.known["phidot"][places], list[Floats]()

        def slips(z: Floats) -> Floats:
            found: Floats = begun + jacobian @ (z[1 + nq : ny] - facts.u)
            return found

        def onward(_: float, z: Floats) -> Floats:
            way = straight[0] if straight else np.concatenate(self._pushed(z[:ny])[:2])
            return np.append(way, -way[ny:][pushing] * slips(z))

        def least(z: Floats) -> float:
            return float(np.min(np.sign(begun) * slips(z), where=begun != 0.0, initial=math.inf))

        z = np.concatenate([y, np.zeros(len(names) + len(slides))])
        faded = _FADED * onward(0.0, z)[0]
        for _ in range(_STEPS):
            if not straight:
                way, step = onward(0.0, z), _FARTHEST * self.pace(z[:ny])
                straight += [way[: ny + len(names)]] if way[0] <= faded else []
            if not math.isfinite(step):
                return None
            ahead = partial(runge_kutta_step, onward, 0.0, z)
            if least(ahead(step)) <= 0.0:
                step = brentq(lambda part, ahead=ahead: least(ahead(part)), 0.0, step, xtol=_ROUNDED * step)
                after, pushed, took = np.split(ahead(step), [ny, ny + len(names)])
                return after, pushed, took
            z = ahead(step)
        return None

    def pace(self, y: Floats) -> float:
        """Return the s in which speeds would change by as much as the largest are; infinite where they do not."""
        change: Floats = np.abs(self.slope(y)[0][-len(self.sizes) :]) / self.sizes
        largest = float(change.max())
        return 1.0 / largest if largest else math.inf

    def slope(self, y: Floats) -> tuple[Floats, float]:
        """Return dy/ds, and m."""
        rates, _, m = self._pushed(y)
        return rates, m

    def _pushed(self, y: Floats) -> tuple[Floats, Floats, float]:
        """Return dy/ds, the rates in s of the impulses of all rows, and m."""
        rates, pushes, _ = self.now.of.pushed(float(y[0]), y[1:])
        with np.errstate(all="ignore"):  # nothing may push on the way
            m = float(self.push / pushes[self.row])
            return m * np.concatenate([[1.0], rates]), m * pushes, m

    def step(self, y: Floats, s: float) -> Floats:
        """Return y a step on, of order 4."""
        return runge_kutta_step(lambda _, at: self.slope(at)[0], 0.0, y, s)
