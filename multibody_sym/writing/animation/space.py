"""A motion in space for a page: forms of bodies as data for three.js, and their poses as numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.projection import Projection
from multibody_sym.errors import OutputError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Face, Rail
from multibody_sym.scene.items import Anchor, Item
from multibody_sym.writing.animation.frames import Frames, side_by_side, strand_points
from multibody_sym.writing.animation.names import names_in_space, rule
from multibody_sym.writing.animation.packing import packed, short

_COLOURS: Final = (0x5B8DB8, 0xE0A458, 0x6DA67A, 0xB57BA6, 0x8C8C8C, 0xC96F53, 0x4FA3A5, 0xA3A948)
_GROUND: Final = 0x9AA3AD
_FAR: Final = 4.0
"""A motion so many times as far as what moves may be followed: all of it in view, nobody could tell what it is."""
_BELOW: Final = 0.05
"""How far below everything the grid of the ground lies, as a part of its reach."""


def space_stage(frames: Frames, projection: Projection, traces: list[Anchor]) -> tuple[str, dict[str, Any]]:
    """Return the canvas of a motion in space and the numbers that move it."""
    scene, rows = frames.scene, len(frames.times)
    poses = [_poses(np.array([placed.poses[k] for placed in frames.placed])) for k in range(len(scene.bodies))]
    lines = [strand_points(along) for along in zip(*(placed.strands for placed in frames.placed), strict=True)]
    low, high = frames.extent.min(axis=0), frames.extent.max(axis=0)
    up = np.array(scene.up if scene.plane else _upward(frames))
    reach, near = max(float(np.linalg.norm(high - low)), 0.5 * scene.size), frames.near
    firsts = np.cumsum([0, *(3 * line.shape[1] for line in lines)])
    data = {
        "poses": packed(side_by_side(poses, rows)),
        "ropes": packed(side_by_side(lines, rows)),
        "pieces": [[int(first), line.shape[1]] for first, line in zip(firsts, lines, strict=False)],
        "kinds": [strand.kind for strand in scene.strands],
        "bodies": list(scene.bodies),
        "items": [_item(item) for item in scene.items if item.role != "frame"],
        "size": short(scene.size),
        "middle": _shorts((low + high) / 2),
        "low": _shorts(_corner(low, high, up)),
        "floor": _floor(low, high, up),
        "names": names_in_space(scene),
        "rule": rule(),
        "reach": short(reach),
        "near": short(near) if reach > _FAR * near > 0.0 else None,
        "follow": frames.follows,
        "right": _shorts(projection.right),
        "up": _shorts(up),
        "towards": _shorts(projection.toward),
        "traces": [{"body": each.body, "at": _shorts(each.point)} for each in traces],
    }
    return '<canvas width="640" height="400"></canvas>', data


def _floor(low: Floats, high: Floats, up: Floats) -> dict[str, Any]:
    """Return the level grid below everything: its middle and its width, a little more than the motion is wide."""
    middle, half = (low + high) / 2, (high - low) / 2
    below = middle - (float(np.abs(up) @ half) + _BELOW * float(np.linalg.norm(half))) * up
    return {"middle": _shorts(below), "width": short(1.8 * float(np.linalg.norm(half)) or 1.0)}


def _corner(low: Floats, high: Floats, up: Floats) -> Floats:
    """Return where the axes of space stand: the low corner of the grid to the left and in front."""
    floor = _floor(low, high, up)
    level = low - float(low @ up) * up
    found: Floats = level + float(np.array(floor["middle"]) @ up) * up
    return found


def three() -> str:
    """Return three.js as meshcat's wheel carries it. Raises OutputError where that is not installed."""
    from importlib.util import find_spec
    from pathlib import Path

    found = find_spec("meshcat")
    if found is None or found.origin is None:
        raise OutputError("animations in space need meshcat: pip install 'multibody_sym[animate]'", number="O104")
    script = Path(found.origin).parent / "viewer" / "dist" / "main.min.js"
    return script.read_text(encoding="utf-8").replace("</script", "<\\/script")


def _upward(frames: Frames) -> Floats:
    """Return the direction against gravity, z without any."""
    gravity = np.array(frames.scene.gravity)
    size = float(np.linalg.norm(gravity))
    return np.array([0.0, 0.0, 1.0]) if size == 0.0 else -gravity / size


def _poses(poses: Floats) -> Floats:
    """Return places and quaternions (x, y, z, w) of a body (m, 7), without jumps of sign."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(poses[:, :, :3]).as_quat()
    signs = np.where(np.einsum("ij,ij->i", turns[1:], turns[:-1]) < 0.0, -1.0, 1.0)
    turns[1:] *= np.cumprod(signs)[:, None]
    return np.column_stack([poses[:, :, 3], turns])


def _item(item: Item) -> dict[str, Any]:
    """Return an item as the script's builders read it."""
    still = item.on_ground or isinstance(item.form, (Face, Rail)) or item.role == "ground"
    colour = _GROUND if still or item.body < 0 else _COLOURS[item.body % len(_COLOURS)]
    return {"body": item.body, "form": type(item.form).__name__, "colour": colour, **_rounded(asdict(item.form))}


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(each) for each in value]
    return short(value) if isinstance(value, float) else value


def _shorts(values: Any) -> list[float]:
    return [short(float(value)) for value in values]
