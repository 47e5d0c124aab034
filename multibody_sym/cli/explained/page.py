"""The page of an error, and the small models that pages change."""

from __future__ import annotations

from typing import Final, NamedTuple

PENDULUM: Final = """\
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, l: 0.5 m}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}}
"""
SLIDER: Final = """\
multibody_sym: 1
name: block
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, k: 10 N/m}
bodies: {block: {mass: m}}
joints: {guide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
"""
BALL: Final = """\
multibody_sym: 1
name: ball
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 1, inertia: {Izz: 0.1}, surfaces: {rim: {disc: 0.1}}}
joints: {move: {type: planar, parent: ground, child: ball, initial: {q: [0, 0.1, 0]}}}
"""


class Explained(NamedTuple):
    """What a number means. `words` are the command and its options; `file` the model that makes it fail so.

    Where there is no file, `python` is a call that fails so, or nothing does so on purpose.
    """

    title: str
    cause: str
    cure: str
    file: str = ""
    words: tuple[str, ...] = ("check",)
    python: str = ""


def other(text: str, *changes: tuple[str, str]) -> str:
    """Return a model with pieces of its text replaced."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def pendulum(*changes: tuple[str, str]) -> str:
    """Return the pendulum with pieces replaced."""
    return other(PENDULUM, *changes)


def slider(*changes: tuple[str, str]) -> str:
    """Return the block on a guide with pieces replaced."""
    return other(SLIDER, *changes)
