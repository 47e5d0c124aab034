"""The Program of the general theorems: both sides in each state of a run, as numbers to be compared.

    dP/dt = sum F        dL/dt = sum M about the origin        dT/dt = sum of all powers
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from multibody_sym.analysis.theorems.candidates import rates_of_state
from multibody_sym.dynamics.programs.exertions import Exertion, exertions, resultant
from multibody_sym.dynamics.programs.momenta import Momentum, angular_momentum, body_momenta
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.kinematics.wrenches import NO_WRENCH
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import absolute
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import S

THEOREMS: Final = {"momentum": slice(0, 3), "angular_momentum": slice(3, 6), "power": slice(6, 7)}
"""The places of each theorem's components among the seven."""

INTEGRAL: Final = {"momentum": "impulse", "angular_momentum": "angular_impulse", "power": "work"}
"""What each theorem is called in integral form."""


def theorems_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..., udot (nu), multipliers (ns)) -> value, left, right, size, content, each (7).

    P, L and T; their rates; what causes these; the sums of absolute values of both sides' terms, and those of the
    values, body by body. Moments count with the levers' lengths, as what cancels in r x F is rounded too, and so does
    angular momentum: of a ball that spins against its way J omega and r x m v may cancel.
    """
    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    trace = Trace("theorems", (*arrays(mechanism), *unknown))
    motion = motion_of(mechanism, slot_state(mechanism))
    momenta = body_momenta(motion)
    parts = [[*part.momentum, *angular_momentum([part])] for part in momenta]
    flat = [as_node(x) for part in parts for x in part]
    T = as_node(kinetic_energy(motion))
    rates = [as_node(x) for x in tangents([*flat, T], rates_of_state(mechanism))]
    acting = exertions(motion, trace["udot"], row_motions(motion), trace["multipliers"])
    causes, levers = _causes(motion, acting)
    powers = [as_node(each.power) for each in acting]
    of_body = [rates[6 * k : 6 * k + 6] for k in range(len(parts))]
    left_size = [*_sums(of_body, absolute), absolute(rates[-1])]
    right_size = [*_sums(causes, absolute), _sum(map(absolute, powers))]
    size = [_sum(pair) for pair in zip(left_size, right_size, strict=True)]
    columns = {
        "value": [*_sums(parts), T],
        "left": [*_sums(of_body), rates[-1]],
        "right": [*_sums(causes), _sum(powers)],
        "size": [*size[:3], *(x + lever for x, lever in zip(size[3:6], levers, strict=True)), size[6]],
        "content": [*_sums(parts, absolute)[:3], *_sums([_terms(part) for part in momenta])[3:], T],
    }
    return trace.finish({name: ((7,), [as_node(x) for x in values]) for name, values in columns.items()})


def _causes(motion: Motion, acting: Sequence[Exertion]) -> tuple[list[list[S]], list[S]]:
    """Return force and moment (6) of each wrench from outside, and sums of |r| |F| (3)."""
    found: list[list[S]] = []
    lever: S = 0
    for each in acting:
        for index, wrench in enumerate(each.of_body if each.from_outside else ()):
            if wrench is NO_WRENCH:
                continue
            only = [wrench if k == index else NO_WRENCH for k in range(len(motion.bodies))]
            force, moment = resultant(motion, only)
            found.append([*force, *moment])
            lever = lever + _sum(map(absolute, motion.poses[index][1])) * _sum(map(absolute, force))
    return found, [lever] * 3


def _terms(part: Momentum) -> list[S]:
    """Return nothing of a body's momentum, and the sums of the terms of its angular momentum (6)."""
    lever = _sum(map(absolute, part.com)) * _sum(map(absolute, part.momentum))
    return [0, 0, 0, *(absolute(spin) + lever for spin in part.spin)]


def _sums(rows: Iterable[Sequence[S]], of: Callable[[S], S] | None = None) -> list[S]:
    """Return the sums of six columns, or of their absolute values."""
    return [_sum(row[k] if of is None else of(row[k]) for row in rows) for k in range(6)]


def _sum(terms: Iterable[S]) -> S:
    return sum(terms, 0)
