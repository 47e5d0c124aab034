"""Arrows of what pulls at bodies: those of a body cut free, and those of a figure of the whole mechanism."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from multibody_sym.answers.cut_free.letters import force_names
from multibody_sym.answers.cut_free.pulls import CutFree
from multibody_sym.answers.cut_free.records import Pull
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import vector
from multibody_sym.scene.items import ArrowItem

_NEGLIGIBLE: Final = 1e-9
"""Forces below this part of the largest are zero but for rounding, and have no direction."""


def all_arrows(cut: CutFree) -> list[ArrowItem]:
    """Return all forces and couples on all bodies, each the way in which its letter counts, as in the equations."""
    return _arrows(cut, list(cut.pulls()), lambda pull: abs(pull.value) * pull.way)


def reaction_arrows(cut: CutFree) -> tuple[ArrowItem, ...]:
    """Return what joints, contacts, ropes, rods and stops exert, as it acts: on the child, ropes at both ends."""
    pulls, seen = [], set()
    for pull in cut.pulls():
        place = (pull.key, pull.turns)
        if pull.at.body in cut.ground or pull.is_applied or (place in seen and not pull.both):
            continue
        seen.add(place)
        pulls.append(pull)
    return tuple(_arrows(cut, pulls, lambda pull: pull.vector))


def applied_arrows(cut: CutFree) -> tuple[ArrowItem, ...]:
    """Return the weights, and the pulls of springs and the like, which no arrow of the scene shows."""
    shown = {arrow.path for arrow in cut.scene.arrows}
    pulls = [pull for pull in cut.pulls() if pull.is_applied and pull.path not in shown and pull.key[0] != "drive"]
    return tuple(_arrows(cut, [p for p in pulls if p.at.body not in cut.ground], lambda pull: pull.vector))


def _arrows(cut: CutFree, pulls: Sequence[Pull], drawn: Callable[[Pull], Floats]) -> list[ArrowItem]:
    """Return arrows of what is more than rounding, couples also of the moments that forces have; what is open, of all.

    That points as its possible value does, where this is none the way in which its letter counts.
    """
    known = [pull for pull in pulls if np.isfinite(pull.size)]
    forces, couples = (max((p.size for p in known if p.turns == turns), default=0.0) for turns in (False, True))
    largest = {False: forces, True: max(couples, forces * cut.scene.size)}
    seen = [pull.size > _NEGLIGIBLE * largest[pull.turns] for pull in pulls]
    pairs = zip(pulls, seen, strict=True)
    kept = [pull if large else replace(pull, value=1.0) for pull, large in pairs if large or pull.open]
    names = force_names(cut.system, cut.scene.mechanism, [*_acting(kept), *cut.lasting()])
    return [
        ArrowItem(_role(pull), pull.path[1], names[pull.key], pull.path, pull.at, vector(drawn(pull)), open=pull.open)
        for pull in kept
        if np.isfinite(pull.vector).all()
    ]


def _acting(pulls: Iterable[Pull]) -> list[tuple[str, ...]]:
    return list(dict.fromkeys(pull.key for pull in pulls))


def _role(pull: Pull) -> Literal["force", "torque", "reaction", "couple"]:
    if pull.is_applied:
        return "torque" if pull.turns else "force"
    return "couple" if pull.turns else "reaction"
