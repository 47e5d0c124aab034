"""Several contacts at once: the laws of an instant for speeds, searched like those of accelerations."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, chosen
from multibody_sym.dynamics.impacts.problem import Stage
from multibody_sym.dynamics.laws.problem import LawState
from multibody_sym.dynamics.laws.search import find
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats


def joined(account: Account) -> None:
    """Let what holds both ways take the speeds that are wanted of it, where they are not there already."""
    if account.unfulfilled():
        _search(account, (), np.zeros(len(account.z)), "joined")


def newton(account: Account, closed: Collection[int]) -> None:
    """Strike rows at once: v+ + e v- >= 0 beside p >= 0, and friction in its cone against v_t+."""
    wanted = np.zeros(len(account.z))
    for k in closed:
        wanted[k] = -account.restitution[k] * account.speeds()[k]
    z = _search(account, closed, wanted, "at once")
    account.compression = account.compression + z / (1.0 + account.restitution)


def _search(account: Account, closed: Collection[int], wanted: Floats, stage: Stage) -> Floats:
    """Add the impulses after which all laws hold for v+ - wanted (m), and return them."""
    some = chosen(account.rows, closed)
    now = account.speeds()
    found = find(replace(some.problem, right=(wanted - now)[some.rows]), every=False)
    if not found.states:
        raise NoSolutionError(_nothing(account, closed))
    state = found.states[0]
    z = np.zeros(len(now))
    z[some.rows] = state.z
    slips = [0] * len(account.rows.parts)
    for k, slip in zip(some.parts, state.mode.slips, strict=True):
        slips[k] = slip
    account.add(stage, _pressed(closed, some.rows, state), tuple(slips), (z, state.x))
    return z


def _pressed(closed: Collection[int], rows: list[int], state: LawState) -> list[int]:
    return [k for k, side in zip(rows, state.mode.sides, strict=True) if k in closed and side]


def _nothing(account: Account, closed: Collection[int]) -> str:
    names = ", ".join(account.problem.name(k) for k in sorted(closed)) or "what holds both ways"
    return f"no impulses fulfil the laws of the impact at {names}: the speeds wanted there contradict each other"
