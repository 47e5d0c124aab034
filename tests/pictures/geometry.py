"""What is wrong with a picture as geometry, found by sampling its lines: text over text, text over lines, cuts."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from multibody_sym.pictures.page.picture import SIZES, Picture, TextMark

LEAST_TYPE = 8.0
STRIDE = 0.4


def faults(picture: Picture) -> list[str]:
    """Return what is wrong, as sentences; nothing where all is well."""
    return [*_text_over_text(picture), *_text_over_lines(picture), *_cut_off(picture), *_small_type(picture)]


def texts(picture: Picture) -> list[TextMark]:
    return [mark for mark in picture.simple if isinstance(mark, TextMark)]


def shown(text: TextMark) -> str:
    return "".join(run for run, _ in text.runs)


def _text_over_text(picture: Picture) -> Iterator[str]:
    boxes = [(shown(text), text.box) for text in texts(picture)]
    for i, (one, a) in enumerate(boxes):
        for other, b in boxes[:i]:
            if a.left < b.right and b.left < a.right and a.bottom < b.top and b.bottom < a.top:
                yield f"{one!r} lies over {other!r}"


def _text_over_lines(picture: Picture) -> Iterator[str]:
    lines = [_sampled(mark) for mark in picture.simple if not isinstance(mark, TextMark) and mark.pen is not None]
    owners = [mark for mark in picture.simple if not isinstance(mark, TextMark) and mark.pen is not None]
    for text in texts(picture):
        _, left, bottom, right, top = text.box
        for owner, points in zip(owners, lines, strict=True):
            x, y = points.T
            if ((left < x) & (x < right) & (bottom < y) & (y < top)).any():
                yield f"{shown(text)!r} lies over a line of {owner.role} {owner.name!r}"
                break


def _sampled(mark: object) -> np.ndarray:
    """Return points of a line, closer together than the smallest letters are high."""
    points = np.asarray(mark.points)
    if getattr(mark, "closed", False):
        points = np.vstack((points, points[:1]))
    pieces = []
    for p, q in pairwise(points):
        count = int(np.hypot(*(q - p)) / STRIDE) + 2
        pieces.append(p + np.linspace(0, 1, count)[:, None] * (q - p))
    return np.vstack(pieces)


def _cut_off(picture: Picture) -> Iterator[str]:
    for (role, name), boxes in picture.boxes().items():
        for box in boxes:
            if min(box.left, box.bottom, picture.width - box.right, picture.height - box.top) < 0:
                yield f"{role} {name!r} is cut off at {box}"


def _small_type(picture: Picture) -> Iterator[str]:
    for text in texts(picture):
        least = min(text.size * SIZES[style] for _, style in text.runs)
        if least < LEAST_TYPE:
            yield f"{shown(text)!r} is of {least:.1f} pt"
