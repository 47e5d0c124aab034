"""A picture in words, for readers who cannot see it: the bodies, what joins them, what acts between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from multibody_sym.drawing.shown import Shown
from multibody_sym.scene.items import Item, Placed
from multibody_sym.scene.scene import Scene

_MOST: Final = 30
_REACTIONS: Final = ("reaction", "couple")


def description(scene: Scene, placed: Placed, shown: Shown) -> str:
    """Return sentences that say what a picture shows."""
    view = "in its plane" if scene.plane else "in space"
    told = [
        f"The mechanism {scene.name}, drawn {view}, at t = {placed.time:g} s.",
        _listed("Bodies", scene.bodies),
        _listed("Joints", _named(item for item in scene.items if item.role == "joint")),
        _listed("Pulleys", _named(item for item in scene.items if item.role == "pulley")),
        _listed("Contacts", _named(item for item in scene.items if item.role == "contact")),
        _listed("Stops", [item.label for item in scene.items if item.role == "stop"]),
        _listed("Ropes, springs and the like", [f"{s.name} ({s.kind.replace('_', ' ')})" for s in scene.strands]),
        _listed("Lengths and angles", _once([*(d.label for d in scene.dimensions), *(a.label for a in scene.angles)])),
        _listed("Forces", _once(a.name for a in scene.arrows if a.role not in (*_REACTIONS, "velocity"))),
        _listed("Reactions", _once(a.name for a in scene.arrows if a.role in _REACTIONS)),
        _listed("Not unique, because constraints depend on each other", shown.not_unique),
        _listed("Marked", [f"{'.'.join(path)}{f' ({word})' if word else ''}" for path, word in shown.marked.items()]),
    ]
    return " ".join(sentence for sentence in told if sentence)


def _named(items: Iterable[Item]) -> list[str]:
    """Return names once each, with what kind of symbol stands for them."""
    kinds: dict[str, str] = {}
    for item in items:
        kind = getattr(item.form, "kind", "")
        kinds[item.name] = kinds.get(item.name) or kind
    return [f"{name} ({kind.replace('_', ' ')})" if kind else name for name, kind in kinds.items()]


def _once(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _listed(what: str, names: Sequence[str]) -> str:
    if not names:
        return ""
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return f"{what}: {', '.join(names[:_MOST])}{more}."
