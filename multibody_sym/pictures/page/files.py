"""Pictures as files: SVG and TikZ as text, PNG and PDF by matplotlib; the same bytes every time."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import unicodedata
from collections.abc import Iterable, Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.errors import OutputError
from multibody_sym.pictures.page.picture import DROPS, SIZES, Arc, Pen, Picture, Simple, Stroke, TextMark, run_width
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.printer import GREEK

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
            yield _svg_letters(mark, height)
        elif isinstance(mark, Arc) and mark.full:
            x, y = mark.centre
            yield f'<circle cx="{number(x)}" cy="{number(height - y)}" r="{number(mark.radius)}"{_svg_paint(mark)}/>'
        elif isinstance(mark, Arc):
            yield f'<path d="{_svg_arc(mark, height)}"{_svg_paint(mark)}/>'
        else:
            places = [f"{number(x)} {number(height - y)}" for x, y in np.asarray(mark.points).tolist()]
            yield f'<path d="M{"L".join(places)}{"Z" if mark.closed else ""}"{_svg_paint(mark)}/>'


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


def _svg_arc(mark: Arc, height: float) -> str:
    """Return the path of an arc; counterclockwise on a page whose y points up."""
    ends = [np.asarray(mark.centre) + mark.radius * np.array([np.cos(a), np.sin(a)]) for a in (mark.start, mark.stop)]
    (x0, y0), (x1, y1) = ends
    large, turn = int(abs(mark.stop - mark.start) > np.pi), int(mark.stop < mark.start)
    radius = number(mark.radius)
    return (
        f"M{number(x0)} {number(height - y0)}A{radius} {radius} 0 {large} {turn} {number(x1)} {number(height - y1)}"
        + ("Z" if mark.fill else "")
    )


def _svg_paint(mark: Stroke | Arc) -> str:
    pen: Pen | None = mark.pen
    fill = f' fill="{mark.fill or "none"}"'
    if pen is None:
        return fill
    dash = f' stroke-dasharray="{" ".join(number(d) for d in pen.dash)}"' if pen.dash else ""
    return f'{fill} stroke="{pen.colour}" stroke-width="{number(pen.width)}"{dash}'


def _svg_letters(mark: TextMark, height: float) -> str:
    """Return one text with a span for each run, each as wide as the layout took it to be."""
    x, y = (float(v) for v in mark.at)
    spans = []
    for run in mark.runs:
        text, style = run
        wide, size, low = run_width(run, mark.size), mark.size * SIZES[style], mark.size * DROPS[style]
        slanted = ' font-style="italic"' if style == "italic" else ""
        spans.append(
            f'<tspan x="{number(x)}" y="{number(height - y + low)}" font-size="{number(size)}"{slanted} '
            f'textLength="{number(wide)}" lengthAdjust="spacingAndGlyphs">{escaped_xml(text)}</tspan>'
        )
        x += wide
    colour = "" if mark.colour == "#000000" else f' fill="{mark.colour}"'
    return f'<text{colour} xml:space="preserve">{"".join(spans)}</text>'


# ----------------------------------------------------------------------------------------------------------------------
# Pictures in TikZ: a picture to paste into a document, or a document of its own that compiles by pdflatex.


_SPECIAL: Final = {
    "\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\textquotedbl{}", "'": "{'}", "`": "{`}", "-": "{-}",
    **{c: f"\\{c}" for c in "#$%&_{}"},
    "°": r"\textdegree{}", "·": r"\textperiodcentered{}", "²": r"\texttwosuperior{}", "³": r"\textthreesuperior{}",
    "…": r"\dots{}", "±": r"\textpm{}", "×": r"\texttimes{}", "µ": r"$\mu$", "≈": r"$\approx$", "−": "$-$",
    "≤": r"$\leq$", "≥": r"$\geq$",
}  # fmt: skip
_CAPITALS: Final = frozenset("Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega".split())
_LETTERS: Final = {
    **{
        letter: rf"$\mathit{{\{name}}}$" if name in _CAPITALS else rf"$\{'varphi' if name == 'phi' else name}$"
        for name, letter in GREEK.items()
    },
    "ϕ": r"$\phi$", "ο": "o",
}  # fmt: skip
_HEAD: Final = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{textcomp}
\IfFileExists{tgtermes.sty}{\usepackage{tgtermes}}{\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}}
\usepackage{tikz}
\pagestyle{empty}
\setlength{\parindent}{0pt}
"""


_FITTED: Final = (
    r"\providecommand{\fitted}[2]{\sbox0{#2\vphantom{x}}"
    r"\ifdim\wd0>#1\relax\resizebox{#1}{\height}{\usebox0}\else\usebox0\fi}%"
)
"""Letters no wider than the layout took them to be, whatever fonts there are."""


_LACKING: Final = frozenset("ĦħĸĿŀŉŦŧ")
"""Latin letters that inputenc does not know in T1."""


def tikz(picture: Picture, *, alone: bool = True) -> str:
    """Return a picture as a document whose only page is the picture, or as a `tikzpicture` alone (`alone` False)."""
    lines = [
        _FITTED,
        r"\begin{tikzpicture}[x=1bp,y=1bp,line join=round,line cap=round]",
        rf"\useasboundingbox (0,0) rectangle ({number(picture.width)},{number(picture.height)});",
        *(line for mark in picture.simple for line in _mark_lines(mark)),
        r"\end{tikzpicture}",
    ]
    if not alone:
        return "\n".join(lines) + "\n"
    paper = (
        rf"\usepackage[paperwidth={number(picture.width)}bp,paperheight={number(picture.height)}bp,margin=0bp]"
        r"{geometry}"
    )
    plain = "".join(c if c.isascii() and (c.isalnum() or c in " ,-") else " " for c in picture.title)
    title = f"\\pdfinfo{{/Title ({plain})}}"
    page = [r"\hoffset-1in\voffset-1in\setbox1\hbox{%", *lines, r"}\shipout\box1"]
    body = [paper, title, r"\begin{document}", *page, r"\end{document}"]
    return _HEAD + "\n".join(body) + "\n"


def escaped_tex(text: str) -> str:
    """Return text in which TeX finds no command; letters that its fonts lack as the nearest that they have, or as ?."""
    return "".join(_SPECIAL.get(c) or _LETTERS.get(c) or _nearest(c) for c in text)


def _nearest(character: str) -> str:
    if " " <= character <= "~":
        return character
    if "\u00c0" <= character <= "\u017e" and character not in _LACKING:  # Latin letters of T1
        return character
    plain = "".join(c for c in unicodedata.normalize("NFKD", character) if " " <= c <= "~")
    return "".join(_SPECIAL.get(c, c) for c in plain) if plain else "?"


def _mark_lines(mark: Simple) -> Iterator[str]:
    if isinstance(mark, TextMark):
        # a node for each run, in a box of the width that the layout took it to have
        x, y = (float(v) for v in mark.at)
        colour = "" if mark.colour == "#000000" else f",text={_colour(mark.colour)}"
        for run in mark.runs:
            text, style = run
            wide, size, low = run_width(run, mark.size), mark.size * SIZES[style], mark.size * DROPS[style]
            slanted = r"\itshape" if style == "italic" else ""
            if text.strip():
                yield (
                    rf"\node[anchor=base west,inner sep=0pt,outer sep=0pt{colour}] at ({number(x)},{number(y - low)}) "
                    rf"{{\fontsize{{{number(size)}pt}}{{{number(size)}pt}}\selectfont{slanted}"
                    rf"\fitted{{{number(wide)}bp}}{{{escaped_tex(text)}}}}};"
                )
            x += wide
        return
    if isinstance(mark, Arc):
        centre = np.asarray(mark.centre)
        if mark.full:
            path = f"{_place(centre.tolist())} circle[radius={number(mark.radius)}]"
        else:
            first = centre + mark.radius * np.array([np.cos(mark.start), np.sin(mark.start)])
            start, stop = np.degrees((mark.start, mark.stop))
            close = " -- cycle" if mark.fill else ""
            path = (
                f"{_place(first.tolist())} arc[start angle={number(start)},end angle={number(stop)},"
                f"radius={number(mark.radius)}]{close}"
            )
    else:
        path = " -- ".join(_place(p) for p in np.asarray(mark.points).tolist()) + (" -- cycle" if mark.closed else "")
    yield rf"\path[{','.join(_tikz_paint(mark))}] {path};"


def _place(point: list[float]) -> str:
    return f"({number(point[0])},{number(point[1])})"


def _tikz_paint(mark: Stroke | Arc) -> Iterator[str]:
    if mark.fill is not None:
        yield f"fill={_colour(mark.fill)}"
    if mark.pen is not None:
        yield f"draw={_colour(mark.pen.colour)}"
        yield f"line width={number(mark.pen.width)}bp"
        if mark.pen.dash:
            parts = (f"{'off' if i % 2 else 'on'} {number(d)}bp" for i, d in enumerate(mark.pen.dash))
            yield f"dash pattern={' '.join(parts)}"


def _colour(code: str) -> str:
    red, green, blue = (int(code[i : i + 2], 16) for i in (1, 3, 5))
    return f"{{rgb,255:red,{red};green,{green};blue,{blue}}}"


# ----------------------------------------------------------------------------------------------------------------------
# Figures of matplotlib as files, in its default style and the same bytes each time.


def write_figure(figure: Any, path: str | os.PathLike[str]) -> None:
    """Write the figure as PNG, SVG or PDF, by the ending of `path`. Raises OutputError."""
    ending = os.path.splitext(path_name(path))[1].removeprefix(".").lower() or "png"
    write_whole(path, figure_content(figure, ending, _PRINTED))


_PRINTED: Final = 200
"""Dots an inch of a figure in a file."""


def figure_content(figure: Any, ending: str, dots: float | None = None) -> bytes:
    """Return the figure in a format, the same bytes each time; `dots` an inch, those of a screen unless told.

    Raises OutputError for what is no format.
    """
    import matplotlib as mpl

    found, dated = io.BytesIO(), {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with plain_style(), mpl.rc_context({"svg.hashsalt": "multibody_sym"}), _fixed_layout(figure):
        try:
            figure.savefig(found, format=ending, dpi=dots or "figure", metadata=dated.get(ending))
        except ValueError as problem:
            raise OutputError(f"the figure cannot be written as '{ending}': {problem}", number="O102") from None
    return found.getvalue()


@contextlib.contextmanager
def _fixed_layout(figure: Any) -> Iterator[None]:
    """Lay a figure out now: one whose layout is asked for while it is written is drawn twice."""
    engine = figure.get_layout_engine()
    if engine is None:
        yield
        return
    engine.execute(figure)
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


@contextlib.contextmanager
def plain_style() -> Iterator[None]:
    """Use matplotlib in its default style; a settings file in the working folder is not read."""
    try:
        with _elsewhere() if "matplotlib" not in sys.modules else contextlib.nullcontext():
            import matplotlib.style
    except ImportError:
        raise OutputError("plots need matplotlib: pip install 'multibody_sym[plot]'", number="O104") from None
    with matplotlib.style.context("default"):
        yield


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    """Work in the root folder for a moment: matplotlib looks for its settings in the working folder first."""
    before = os.getcwd()
    os.chdir(os.path.abspath(os.sep))
    try:
        yield
    finally:
        os.chdir(before)


# ----------------------------------------------------------------------------------------------------------------------
# Pictures as PNG and PDF by matplotlib, which is asked to draw marks and to lay out nothing.


DOTS: Final = 200
"""Dots per inch of a PNG."""
_INCH: Final = 72.0


def raster(picture: Picture, ending: str) -> bytes:
    """Return a picture as `png` or `pdf`, the same bytes every time. Raises OutputError without matplotlib."""
    content = io.BytesIO()
    with plain_style():
        figure = _figure(picture, DOTS)
        nameless = ("CreationDate", "Creator", "Producer") if ending == "pdf" else ("Software",)  # no versions, no date
        metadata = {"Title": picture.title, **dict.fromkeys(nameless)}
        figure.savefig(content, format=ending, dpi=DOTS, metadata=metadata)
    return content.getvalue()


def pixels(picture: Picture, dots: int) -> Any:
    """Return a picture as red, green and blue (height, width, 3), both sizes even. Raises OutputError."""
    with plain_style():
        figure = _figure(picture, dots)
        figure.canvas.draw()
        found = np.asarray(figure.canvas.buffer_rgba())[:, :, :3]
    height, width = (2 * (size // 2) for size in found.shape[:2])
    return np.ascontiguousarray(found[:height, :width])


def _figure(picture: Picture, dots: int) -> Any:
    """Return a figure of matplotlib that holds the marks and nothing else."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width / _INCH, picture.height / _INCH), dpi=dots, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, picture.width)
    axes.set_ylim(0.0, picture.height)
    for order, mark in enumerate(picture.simple):
        for artist in _letters(mark, order) if isinstance(mark, TextMark) else [_line(mark, order)]:
            axes.add_artist(artist)
    return figure


def _line(mark: Stroke | Arc, order: int) -> Any:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if isinstance(mark, Arc) and mark.full:
        path = Path.circle(tuple(mark.centre), mark.radius)
    elif isinstance(mark, Arc):
        unit = Path.arc(np.degrees(mark.start), np.degrees(mark.stop))
        path = Path(np.asarray(unit.vertices) * mark.radius + np.asarray(mark.centre), unit.codes)
    else:
        points = np.asarray(mark.points)
        path = Path(np.vstack((points, points[:1])), closed=True) if mark.closed else Path(points)
    pen = mark.pen
    dash = ((0, [d / pen.width for d in pen.dash]) if pen.dash else "-") if pen else "-"
    return PathPatch(
        path,
        facecolor=mark.fill or "none",
        edgecolor=pen.colour if pen else "none",
        linewidth=pen.width if pen else 0.0,
        linestyle=dash,
        joinstyle="round",
        capstyle="round",
        zorder=order + 1,
    )


def _letters(mark: TextMark, order: int) -> list[Any]:
    """Return the runs as outlines of STIX letters, as wide as the layout took them to be; a $ starts no formula."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.patches import PathPatch
    from matplotlib.textpath import TextPath
    from matplotlib.transforms import Affine2D

    x, y = (float(v) for v in mark.at)
    found = []
    for run in mark.runs:
        text, style = run
        wide, size, low = run_width(run, mark.size), mark.size * SIZES[style], mark.size * DROPS[style]
        font = FontProperties(family=["STIXGeneral", "DejaVu Serif"], style="italic" if style == "italic" else "normal")
        if text.strip():
            outline = TextPath((0, 0), text.replace("$", r"\$"), size=size, prop=font, usetex=False)
            natural = outline.get_extents().x1 or wide
            squeeze = min(1.0, wide / natural)
            place = Affine2D().scale(squeeze, 1.0).translate(x, y - low)
            found.append(PathPatch(place.transform_path(outline), facecolor=mark.colour, linewidth=0, zorder=order + 1))
        x += wide
    return found
