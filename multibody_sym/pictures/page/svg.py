"""Pictures as SVG: strokes as paths, circles as circles, letters as text of fixed widths; the same bytes every time."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from multibody_sym.pictures.page.picture import DROP, SUBSCRIPT, Arc, Pen, Picture, Simple, Stroke, TextMark, run_width

FAMILY: Final = "'Times New Roman',Times,'Liberation Serif','Nimbus Roman','STIX Two Text',serif"
_ESCAPED: Final = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;"}


def svg(picture: Picture, *, alone: bool = True) -> str:
    """Return a picture as an SVG document of the page's size, or as an element of a page of HTML (`alone` False).

    Its title and description stand in `<title>` and `<desc>`, which readers of screens read aloud.
    """
    width, height = number(picture.width), number(picture.height)
    head = '<?xml version="1.0" encoding="UTF-8"?>\n' if alone else ""
    lines = [
        f'{head}<svg xmlns="http://www.w3.org/2000/svg" version="1.1" role="img" width="{width}pt" height="{height}pt" '
        f'viewBox="0 0 {width} {height}">',
        f"<title>{escaped_xml(picture.title)}</title>",
        f"<desc>{escaped_xml(picture.description)}</desc>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        f'<g font-family="{FAMILY}" stroke-linejoin="round" stroke-linecap="round">',
        *svg_elements(picture.simple, picture.height),
        "</g>",
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def svg_elements(marks: Iterable[Simple], height: float) -> Iterator[str]:
    """Yield marks as elements of an SVG whose page has a height in points."""
    for mark in marks:
        if isinstance(mark, TextMark):
            yield _letters(mark, height)
        elif isinstance(mark, Arc) and mark.full:
            x, y = mark.centre
            yield f'<circle cx="{number(x)}" cy="{number(height - y)}" r="{number(mark.radius)}"{_paint(mark)}/>'
        elif isinstance(mark, Arc):
            yield f'<path d="{_arc(mark, height)}"{_paint(mark)}/>'
        else:
            places = [f"{number(x)} {number(height - y)}" for x, y in np.asarray(mark.points).tolist()]
            yield f'<path d="M{"L".join(places)}{"Z" if mark.closed else ""}"{_paint(mark)}/>'


def escaped_xml(text: str) -> str:
    """Return text in which XML finds no tag, entity or quote, without characters that XML does not allow."""
    kept = []
    for c in text:
        blank = unicodedata.category(c) == "Zs"  # such as the thin one of a product
        allowed = c.isprintable() or blank or c in "\t\n" or 0xE000 <= ord(c) < 0xFFFE or ord(c) > 0xFFFF
        kept.append(_ESCAPED.get(c, c) if allowed else "\ufffd")
    return "".join(kept)


def number(value: float) -> str:
    """Return a length to a hundredth of a point, as short as it goes."""
    shown = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if shown == "-0" else shown


def _arc(mark: Arc, height: float) -> str:
    """Return the path of an arc; counterclockwise on a page whose y points up."""
    ends = [np.asarray(mark.centre) + mark.radius * np.array([np.cos(a), np.sin(a)]) for a in (mark.start, mark.stop)]
    (x0, y0), (x1, y1) = ends
    large, turn = int(abs(mark.stop - mark.start) > np.pi), int(mark.stop < mark.start)
    radius = number(mark.radius)
    return (
        f"M{number(x0)} {number(height - y0)}A{radius} {radius} 0 {large} {turn} {number(x1)} {number(height - y1)}"
        + ("Z" if mark.fill else "")
    )


def _paint(mark: Stroke | Arc) -> str:
    pen: Pen | None = mark.pen
    fill = f' fill="{mark.fill or "none"}"'
    if pen is None:
        return fill
    dash = f' stroke-dasharray="{" ".join(number(d) for d in pen.dash)}"' if pen.dash else ""
    return f'{fill} stroke="{pen.colour}" stroke-width="{number(pen.width)}"{dash}'


def _letters(mark: TextMark, height: float) -> str:
    """Return one text with a span for each run, each as wide as the layout took it to be."""
    x, y = (float(v) for v in mark.at)
    spans = []
    for run in mark.runs:
        text, style = run
        wide = run_width(run, mark.size)
        small = style == "subscript"
        size = mark.size * (SUBSCRIPT if small else 1.0)
        low = mark.size * DROP if small else 0.0
        slanted = ' font-style="italic"' if style == "italic" else ""
        spans.append(
            f'<tspan x="{number(x)}" y="{number(height - y + low)}" font-size="{number(size)}"{slanted} '
            f'textLength="{number(wide)}" lengthAdjust="spacingAndGlyphs">{escaped_xml(text)}</tspan>'
        )
        x += wide
    colour = "" if mark.colour == "#000000" else f' fill="{mark.colour}"'
    return f'<text{colour} xml:space="preserve">{"".join(spans)}</text>'
