"""Integrates model.py from the start in names.json by Runge and Kutta's method of order 4.

    python integrate.py [end of time in s] [step in s]

Where there are constraints, each step is put back onto them, positions first. What holds one way only stays in the
state of the start, which names.json tells under `mode`; where that state ends the loop stops, as what follows it is
another model.
"""

import json
import math
import sys
from pathlib import Path

from model import PROGRAMS

ITERATIONS = 5
ROUNDED = 1e-9  # the part of its largest value by which what ends the state of the start may exceed zero
TABLE = Path(__file__).parent / "names.json"
if not TABLE.exists():
    sys.exit(f"there is no file {TABLE}, which has the start: the export writes it beside this one")
NAMES = json.loads(TABLE.read_text(encoding="utf-8"))
PARAMETERS = [entry["value"] for entry in NAMES["parameters"]]


def asked(program, t, q, u):
    """The outputs of a program at a state, the inputs taking their declared values."""
    (inputs,) = PROGRAMS["inputs"](t, q, u, PARAMETERS)
    return PROGRAMS[program](t, q, u, PARAMETERS, inputs, [])


def rates(t, q, u):
    qdot, udot, _multipliers, _report = asked("state_derivative", t, q, u)
    return qdot, udot


def beside(x, h, rate):
    return [a + h * b for a, b in zip(x, rate, strict=True)]


def kept(t, q, u):
    """The state with unit quaternions, put back onto the constraints."""
    if "normalize" in PROGRAMS:
        q, _deviation = asked("normalize", t, q, u)
    if "project_position" in PROGRAMS:
        for _ in range(ITERATIONS):
            _phi, correction = asked("project_position", t, q, u)
            q = beside(q, 1.0, correction)
        _phidot, correction = asked("project_velocity", t, q, u)
        u = beside(u, 1.0, correction)
    return q, u


def step(t, q, u, h):
    """The state at t + h."""
    k1, l1 = rates(t, q, u)
    k2, l2 = rates(t + h / 2, beside(q, h / 2, k1), beside(u, h / 2, l1))
    k3, l3 = rates(t + h / 2, beside(q, h / 2, k2), beside(u, h / 2, l2))
    k4, l4 = rates(t + h, beside(q, h, k3), beside(u, h, l3))
    q = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(q, k1, k2, k3, k4, strict=True)]
    u = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(u, l1, l2, l3, l4, strict=True)]
    return kept(t + h, q, u)


def ending(t, q, u, largest):
    """The number of what ends the state of the start there, None where it lasts; `largest` values so far are kept."""
    ends = NAMES.get("mode_ends", [])
    values = list(asked("events", t, q, u)[0])[-len(ends) :] if ends else []
    for n, value in enumerate(values):
        largest[n] = max(largest.get(n, 0.0), abs(value))
        if value > ROUNDED * max(1.0, largest[n]):
            return n
    return None


def main(end=1.0, h=1e-3):
    q, u = ([entry["initial"] for entry in NAMES[kind]] for kind in ("coordinates", "speeds"))
    count, largest = max(1, round(end / h)), {}
    if "mode" in NAMES:
        print("of the state at the start only:", ", ".join(f"{name} {word}" for name, word in NAMES["mode"].items()))
    while (number := ending(0.0, q, u, largest)) is not None:  # what has no side at the start tells nothing
        largest[number] = float("inf")
    for n in range(count):
        after = step(n * end / count, q, u, end / count)
        number = ending((n + 1) * end / count, *after, largest)
        if number is not None:
            end = n * end / count
            print(f"stopped at t = {end:.6g} s, where that state ends: {NAMES['mode_ends'][number]}")
            break
        q, u = after
    for entry, x in zip(NAMES["coordinates"] + NAMES["speeds"], q + u, strict=True):
        print(f"{entry['name']} = {x!r} {entry['unit']}".rstrip())
    if "project_position" in PROGRAMS:
        print("largest |phi| =", max([0.0, *map(abs, asked("project_position", end, q, u)[0])]))


def positive(words):
    """The numbers that the words of a command line are, at most an end of time and a step."""
    for word in words[:2]:
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not 0.0 < number < math.inf:
            sys.exit(f"the end of time, and a step, are positive numbers of seconds, not {word}")
        yield number
    if len(words) > 2:
        sys.exit(f"there are two numbers at most, not {words[2]}: the end of time and a step")


if __name__ == "__main__":
    main(*positive(sys.argv[1:]))
