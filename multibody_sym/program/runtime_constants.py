"""Codes and tolerances that the C of the runtime shares with Python, each written here once.

Out: the constants, which the loops in Python import, and the header `constants.h` with which the runtime is compiled,
in which each has `MBS_` before its name. Constants of the rank-revealing solve and of looks within a step stand in
`scalars`, below this room, and enter the header from there.
"""

from __future__ import annotations

import sys
from enum import IntEnum
from typing import Annotated, Final, get_args, get_type_hints

from multibody_sym.scalars.arrays import EPSILON


class Status(IntEnum):
    """How a run stands; the codes from 0 on are C's too."""

    RUNNING = 0
    DONE = 1
    NOT_FINITE = 2
    STEP_UNDERFLOW = 3
    STEP_LIMIT = 4
    CONTRADICTION = 5
    NOT_CLOSED = 6
    STOPPED = 7
    NOT_CONVERGED = 8
    SINGULAR = 9
    INTERRUPTED = -1
    LEFT = -2
    NO_SLOPE = -3
    NO_MODE = -4
    CHATTERS = -5


_STATUS_TEXTS: Final[dict[Status, str]] = {
    Status.NOT_FINITE: "component of (q, u) whose derivative or value is not finite",
    Status.STEP_UNDERFLOW: "component of (q, u) with the largest error",
    Status.CONTRADICTION: "row that is broken because dependent rows ask for different accelerations",
    Status.NOT_CLOSED: "row that projection cannot satisfy",
    Status.STOPPED: "a stop was met: t and x are those of the event",
    Status.NOT_CONVERGED: "component of (q, u) that moved most in Newton's iteration",
    Status.SINGULAR: "rows become dependent, and no step leads across",
}
"""What `component` of the state of a run says at each status."""


class Family(IntEnum):
    """Families of methods."""

    EXPLICIT = 0
    COLLOCATION = 1
    ADAMS = 2
    STOERMER = 3
    VERLET = 4


class Phase(IntEnum):
    """What a run does next."""

    STARTING = 0
    STEPPING = 1
    SAMPLING = 2


class MarginKind(IntEnum):
    """What a switching function of a mode is measured by."""

    FORCE = 0
    LENGTH = 1
    ANGLE = 2
    SPEED = 3


# ----------------------------------------------------------------------------------------------------------------------
# Rows and how far states are put back onto them (constraints.c).

ROUND_OFF: Annotated[float, "rows that small hold"] = 1e-14
ROWS_FLOOR: Annotated[float, "of their size: what round-off leaves of rows at most"] = 4.0 * EPSILON
ROWS_NOTHING: Annotated[float, "of the coordinates' size: phi below that may get worse where speeds get better"] = 1e-12
CLOSING_ROUNDS: Annotated[int, "corrections of a state at most"] = 20
MOVED_FAR: Annotated[float, "of the whole step, by which its end may move when it is settled"] = 0.1
FAR_BEYOND_ROUND_OFF: Annotated[float, "of the largest component: less counts as unmoved"] = 1e-10

# ----------------------------------------------------------------------------------------------------------------------
# Length and number of steps (runtime.c, trials.c).

PASSED: Annotated[int, "singular positions that a step can report"] = 8
DOUBLED: Annotated[int, "doublings of the number of steps whose times are kept"] = 7
LEAST_PACE: Annotated[int, "steps from which a run tells whether it takes too many"] = 1 << 17
SAME_PART: Annotated[float, "of the largest ratio of times: least ratio of a steady approach"] = 0.5
LEAST_ERROR: Annotated[float, "remembered at least: a lucky step does not let the next grow without measure"] = 1e-4
SAFETY: Annotated[float, "of the step for which the error is as large as allowed"] = 0.9
GROWTH: Annotated[float, "of a step at most"] = 10.0
SHRINKAGE: Annotated[float, "of a step at most"] = 5.0
RETREAT: Annotated[float, "of the step, when a trial step could not be evaluated at all"] = 0.25
LEAST_PART: Annotated[float, "of a fixed step, into which one near a singular position may be divided"] = 1e-3
LEAST_AT_KINK: Annotated[float, "of the time of the run: a kink in so short a step is a jump"] = 1e-9

# ----------------------------------------------------------------------------------------------------------------------
# Looks at switching functions within a step (looks.c).

LEAST_STEPS: Annotated[float, "of a run in modes, ..."] = 200.0
STANDING: Annotated[float, "... and of one in which nothing moves, so that no rate tells what comes"] = 1000.0
MOST_CHANGE: Annotated[float, "of its distance from zero: how far a function that keeps steps short changes, ..."] = 0.5
MOST_OF_ALL: Annotated[float, "... or of the largest it had, where it does not end before zero"] = 0.1
BESIDE: Annotated[float, "margins: a function that near zero all along a piece is zero but for round-off"] = 32.0
MOVED: Annotated[float, "part of the largest component by which the state is moved, ..."] = 2.0**-20
GOLDEN: Annotated[float, "... each component differently, so that all differences change"] = 0.6180339887498949

# ----------------------------------------------------------------------------------------------------------------------
# Where switching functions cross zero (events.c).

BEYOND: Annotated[float, "part of a step by which its extension is followed beyond its end"] = 1e-6
ROUNDED_TIME: Annotated[float, "part of a time by which a crossing at the end of a run may seem later"] = 16.0 * EPSILON
JUST_BEFORE: Annotated[float, "part of a time by which the slope at a kink is taken before it"] = 8.0 * EPSILON
SHORT_OF: Annotated[float, "part of the way to the crossing by which the repeated step ends before it, ..."] = 1e-7
SHORTER: Annotated[float, "... this many times more whenever that was not enough"] = 100.0
AT_ONCE: Annotated[float, "part of a step in which a function that crosses back after its own event chatters"] = 1e-3
SOON: Annotated[float, "part of time and state in which a function shows whether it turns back"] = 2.0**-36
REPEATS: Annotated[int, "of a step to just before a crossing"] = 20
LOCATING_ROUNDS: Annotated[int, "reductions of the time in which a function crosses"] = 200

# ----------------------------------------------------------------------------------------------------------------------
# Steps over singular positions (singular.c, stages.c).

NEAR: Annotated[float, "of the largest independence about a step: with less in it the step is near one, ..."] = 0.5
NEAR_BY: Annotated[float, "... as with less than this part of the largest in the run"] = 0.1
USUAL: Annotated[float, "the largest independence at least"] = 0.01
MARGIN: Annotated[float, "of the largest about a step: nothing in it may be nearer than that, ..."] = 0.05
LEAST: Annotated[float, "... nor than this"] = 1e-8
HELD: Annotated[float, "where no step leads across, of the start's: nothing in it may be nearer, ..."] = 0.25
LEAST_HELD: Annotated[float, "... nor than this, a tenth of what friction that is enough may leave, ..."] = 1e-7
DIPS: Annotated[float, "... nor than that beside both ends"] = 0.75
ROOM: Annotated[float, "of what the step across needs before it: no step may end with less"] = 0.5
NOISE: Annotated[float, "what round-off leaves of rows that are closed, ..."] = 1e-16
MANY: Annotated[float, "... but where many depend on each other so many times more, ..."] = 50.0
MOST_NOISE: Annotated[float, "... which is to falsify no step by more"] = 1e-7
GOLDEN_RETREAT: Annotated[float, "a step that much shorter meets no node of the one before"] = 0.618033988749895
SHORTER_AHEAD: Annotated[float, "at most, where it is known what lies ahead"] = 0.8
ASIDE: Annotated[float, "times the way to the middle of the widest gap: it is wide enough for what lies there"] = 1.2
MOST_VAIN: Annotated[int, "trials of a step that fail, but not as too near, before a Jacobian is taken"] = 3
LOOKS: Annotated[int, "how often the independence is looked at within a step, ..."] = 16
FEW_LOOKS: Annotated[int, "... if looked at so often it may be zero, ..."] = 4
STEEPER: Annotated[float, "... going so many times as steeply as between any two looks"] = 3.0
SEEN: Annotated[float, "at most, what was seen otherwise is beside the looks"] = 1.1
DIP_ROUNDS: Annotated[int, "narrowings of the time at which a singular position was passed"] = 5
DIFFERENCE: Annotated[float, "of the distance from a singular position: move of states to differentiate slopes"] = 1e-3

# ----------------------------------------------------------------------------------------------------------------------
# Newton's iteration for the stages of implicit methods (implicit.c).

KAPPA: Annotated[float, "of the tolerance: how far Newton's iteration is from its limit when it ends"] = 0.01
SLOW: Annotated[float, "contraction from which on a new Jacobian is worth its price in the next step"] = 1e-2
ADAPTIVE_ROUNDS: Annotated[int, "iterations of an adaptive step at most"] = 10
FIXED_ROUNDS: Annotated[int, "and of a fixed one"] = 50
GROWTHS: Annotated[int, "of the change, under fixed steps: motion may reach what is at rest a round later"] = 3
FAR: Annotated[float, "the step before is no guide to one that is so many times longer"] = 4.0
LEAST_SCALE: Annotated[float, "of the largest component of x and z: no component has to be better than that"] = 1e-6
STANDSTILL: Annotated[float, "an iteration that stands still does so on account of rounding"] = 1e-8
LEAST_GROWTH: Annotated[float, "a step that could grow by less keeps its length, and its factors"] = 1.2

# ----------------------------------------------------------------------------------------------------------------------
# Methods that look back, and displacements of balls (multistep.c, pairing.c).

SAME_LENGTH: Annotated[float, "by which steps may differ and count as equal"] = 1e-9
SHORTEST_STEP: Annotated[float, "of that of the run, below which displacements have too few digits for speeds"] = 1e-3
FARTHEST_TURN: Annotated[float, "of a ball since the oldest point that is used, in radians"] = 2.0
SERIES: Annotated[float, "|phi|^2 below which series are summed"] = 0.5
C_SERIES: Annotated[tuple[float, ...], "|B_2k| / (2k)!: the series of c in s"] = (
    *(1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160),
    *(691 / 1307674368000, 1 / 74724249600, 3617 / 10670622842880000, 43867 / 5109094217170944000),
)
D_SERIES: Annotated[tuple[float, ...], "(-1)^k / (2 k + 3)!: the series of d in s"] = (
    *(1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800, 1 / 1307674368000),
    *(-1 / 355687428096000, 1 / 121645100408832000),
)

# ----------------------------------------------------------------------------------------------------------------------
# Switches of a run in modes that were decided before (turns.c).

TOUCHING: Annotated[float, "of the model's size and largest speed, up to which things touch or are at rest"] = 1e-9
NOT_PUT_BACK: Annotated[float, "of the same: gaps and speeds that are rounding"] = 1e-15
SLIGHT: Annotated[float, "of the largest speeds, by which these may change: a thousand times rest"] = 1e-6
INDEPENDENT: Annotated[float, "part of a row that others leave, where rows are put back"] = 1e-3
DETERMINED: Annotated[float, "the same, where forces are asked: these are known to a tenth of CLEAR_BY"] = 1e-5
MOST_PUT_BACK: Annotated[int, "rows that are put back as they come"] = 8
CLEAR_BY: Annotated[float, "of the largest force, and of an acceleration's terms, by which inequalities hold"] = 3e-10
CLEAR_MOTION: Annotated[float, "of the largest acceleration by which they hold, too"] = 1e-12
WITHIN: Annotated[float, "of that, by which a limit may be exceeded that still counts as kept"] = 0.1
MOST_ACTIVE: Annotated[int, "rows that act"] = 12
BETWEEN_POWERS: Annotated[float, "margins are this many times a power of two"] = 1.37
FORCE_MARGIN: Annotated[float, "of the largest force, by which a switching function of forces may exceed zero"] = 2e-13
SPEED_MARGIN: Annotated[float, "and of the speeds along its row"] = 1e-13
TIME_MARGIN: Annotated[float, "and of the time: a law of time is taken at a rounded time"] = 4.0 * EPSILON
MOST_TIME_MARGIN: Annotated[float, "of the speeds, by time at most: a short push is gone when its slip stops"] = 1e-12
ROUNDED_GAP: Annotated[float, "of the largest length, by which what touches may be off its face by rounding"] = 1e-14
LEAST_LEFT: Annotated[float, "of a time that no step leads on by"] = 16.0 * EPSILON


# ----------------------------------------------------------------------------------------------------------------------
# Contacts and impacts, by which exported C decides states as well (contacts.c).

ULPS: Annotated[float, "roundings that what cancels may be off by"] = 4.0
REMAINING: Annotated[float, "of the time since the first bounce: what bounces no longer than that rests, ..."] = 1e-9
TICKS: Annotated[float, "... and of the time: shorter flights are not resolved"] = 1e3 * EPSILON
LOST_HEIGHT: Annotated[float, "of the largest length: lower bounces are lost in rounding"] = 1e4 * EPSILON
MOST_SWITCHES: Annotated[float, "and impacts of a whole run: each keeps a kilobyte, so many ten gigabytes"] = 1e7
GOES_ON: Annotated[float, "of the time, by which it has to go on to have done so"] = 16.0 * EPSILON


def constants_header() -> str:
    """Return the text of `constants.h`."""
    from multibody_sym.scalars import least_norm, limits, rank, sign_changes

    here = sys.modules[__name__]
    hints = get_type_hints(here, include_extras=True)
    tolerances = [(name, getattr(here, name), get_args(hint)[1]) for name, hint in hints.items() if name[0] != "_"]
    below = [
        ("EPSILON", EPSILON, "the spacing of doubles at 1"),
        ("PROBE", sign_changes.PROBE, "part of a piece of a step over which rates at its ends are measured"),
        ("LEAST_PROBE", sign_changes.LEAST_PROBE, "part of a step over which rates are measured at least, ..."),
        ("MOST_PROBE", sign_changes.MOST_PROBE, "... and of half a piece over which at most"),
        ("LEAST_PIECE", sign_changes.LEAST_PIECE, "part of a step that is not halved any more"),
        ("MOST_LOOKS", sign_changes.MOST_LOOKS, "halvings in a step for one function"),
        ("ROUNDING", rank.ROUNDING, "of the longest row's largest number: rows of smaller ones count as zero"),
        ("TIE", rank.TIE, "lengths closer than this fraction count as equal: the row declared first is taken"),
        ("CLEAR", rank.CLEAR, "of a row's length: where that is left of every row in turn, all are independent"),
        ("VANISHES", rank.ROUNDED, "of the largest impulse: a smaller one is rounding"),
        ("ACCEPTED", limits.ACCEPTED, "of the largest force, and of the terms of a row: inequalities hold to that"),
        ("TIED", limits.TIED, "of their terms: what is left of them is zero below that"),
        ("TOGETHER", limits.TOGETHER, "of closing speeds that differ by less are struck together"),
        ("CONNECTED", limits.CONNECTED, "of their lengths: below that one row does not move another"),
        ("ALIKE", least_norm._ALIKE, "of the longest row: lengths below that may be rounding"),
        ("SHORTEST", least_norm.SHORTEST, "part of the longest row's length that scales shorter rows"),
        ("NEARLY_ZERO", least_norm._NEARLY_ZERO, "sums that are no lengths"),
        ("LARGEST", least_norm._LARGEST, "squares of lengths between this ..."),
        ("SMALLEST", least_norm._LEAST, "... and this have lost no digits"),
        ("PLAIN", least_norm.PLAIN, "acts, and multipliers are of least norm as they are"),
    ]
    enumerations = []
    for kind in (Status, Family, Phase, MarginKind):
        enumerations.append(f"enum {{ /* {kind.__doc__} */")
        for code in kind:
            text = _STATUS_TEXTS.get(code, "") if isinstance(code, Status) else ""
            if code >= 0:
                enumerations.append(f"    MBS_{code.name} = {code:d}," + (f" /* {text} */" if text else ""))
        enumerations += ["};", ""]
    definitions = []
    for name, value, text in (*tolerances, *below):
        several = isinstance(value, tuple)
        printed = "{ \\\n    " + ", \\\n    ".join(map(repr, value)) + "}" if several else repr(value)
        definitions.append(f"#define MBS_{name} {printed} /* {text} */")
    lines = [
        "/* Codes and tolerances that Python has too: written by multibody_sym/program/runtime_constants.py. */",
        "#ifndef MBS_CONSTANTS_H",
        "#define MBS_CONSTANTS_H",
        "",
        *enumerations,
        *definitions,
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"
