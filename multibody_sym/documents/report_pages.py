"""How is a report written: as a page of HTML that reads on a screen and on paper, and as LaTeX?

In: Sections of the blocks of `report_content`. Out: a page with all that it needs in it; a document or a fragment.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from dataclasses import replace
from html import escape
from typing import Any, Final

from multibody_sym.derivation.notation import breakable, escaped
from multibody_sym.documents.animation.animate import player
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.documents.document import Block, Document, HtmlWriter, LatexWriter, Section
from multibody_sym.documents.formulas import harmless, in_known_letters, whole_document
from multibody_sym.documents.report_content import (
    BlocksInLetters,
    Boxed,
    Command,
    Film,
    Folded,
    Givens,
    Pictures,
    Statement,
    WordTable,
)
from multibody_sym.documents.report_findings import Missing, answer
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.pictures.draw import Figure
from multibody_sym.pictures.page.raster import figure_content
from multibody_sym.pictures.page.vector_files import svg, tikz
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.records import dataclass

_OPENED: Final = (
    "for (const [when, open] of [['beforeprint', true], ['afterprint', false]]) addEventListener(when, () => "
    "document.querySelectorAll('details').forEach((x) => {"
    " if (open && !x.open) { x.open = true; x.dataset.shut = ''; }"
    " else if (!open && 'shut' in x.dataset) { x.open = false; delete x.dataset.shut; } }));"
)
"""Details are open on paper, and on the page afterwards as they were."""


class ReportHtml(HtmlWriter):
    """A report as one page: pictures and scripts within it, nothing from elsewhere."""

    def report(self, title: str, sections: Iterable[Section]) -> str:
        """Return the whole page."""
        body = "\n".join(f"<section>\n{self.section(section)}\n</section>" for section in sections)
        style = template_text("html/animation.css") + template_text("html/report.css")
        whole = f'<main class="report"><h1>{escape(title)}</h1>\n{body}</main><script>{_OPENED}</script>'
        return harmless(fill_template("html/page.html.in", title=escape(title), style=style, body=whole))

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return f'<p class="missing">{escape(block.reason)}</p>'
            case BlocksInLetters():
                return "".join(map(ReportHtml(block.notation, self.units, self.level).block, block.blocks))
            case Document():
                return ReportHtml(block.notation, self.units, level=3).body(block)
            case Boxed():
                inside = "".join(map(self.block, block.blocks))
                return f'<div class="answers"><h2>{escape(block.title)}</h2>{inside}</div>'
            case Folded():
                inside = "".join(map(self.block, block.blocks))
                return f"<details><summary>{escape(block.title)}</summary>{inside}</details>"
            case Statement():
                return "".join(self._paragraph(*each) for each in block.paragraphs)
            case Pictures():
                return self._pictures(block.figures, block.title)
            case Givens():
                items = (f"<li>{self.inline(name)} = {self.words(value)}</li>" for name, value in block.rows)
                return f'<ul class="given">{"".join(items)}</ul>'
            case WordTable():
                return self._grid(block)
            case Film():
                return self._film(block)
            case Command():
                return f'<p class="command"><code>{escape(block.text)}</code></p>'
        return super().block(block)

    def _paragraph(self, facts: str, questions: str) -> str:
        asked = f"<strong>{escape(questions)}</strong>" if questions else ""
        return f'<p class="statement">{" ".join(part for part in (escape(facts), asked) if part)}</p>'

    def _pictures(self, figures: Mapping[str, Figure], title: str = "") -> str:
        drawn = {name: svg(figure.picture, alone=False) for name, figure in figures.items()}
        captions = {name: f"<figcaption>{escape(name)}</figcaption>" if name else "" for name in drawn}
        shown = "".join(f"<figure>{each}{captions[name]}</figure>" for name, each in drawn.items())
        head = f"<h3>{title}</h3>" if title else ""
        return f'{head}<div class="row">{shown}</div>' if len(drawn) > 1 or title else shown

    def _grid(self, grid: WordTable) -> str:
        head = "".join(f"<th>{escape(each)}</th>" for each in grid.head)
        rows = "".join(f"<tr>{''.join(f'<td>{self.words(cell)}</td>' for cell in row)}</tr>" for row in grid.rows)
        return f"<h3>{escape(grid.title)}</h3><table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"

    def _film(self, film: Film) -> str:
        """Return the player, for screens, and what paper shows in its place: some instants and the plot."""
        run = film.run
        moving = answer(lambda: player(run, frames_of(run), None, None, None, self.units, 1.0))
        screen = self.block(moving) if isinstance(moving, Missing) else moving
        plot = answer(lambda: _plot(run, self.units))
        curves = "" if isinstance(plot, Missing) else f'<figure><img alt="the motion over time" src="{plot}"></figure>'
        return f'<div class="screen">{screen}</div><div class="paper">{self._pictures(film.stills)}{curves}</div>'


def _plot(run: Trajectory, units: Any) -> str:
    """Return the plot of a run as the address of an image."""
    content = base64.b64encode(figure_content(run.plot(None, units), "svg")).decode("ascii")
    return f"data:image/svg+xml;base64,{content}"


_PACKAGES: Final = ("textcomp", "longtable", "tikz")
_NEEDS: Final = "% needs \\usepackage{amsmath,graphicx,longtable,tikz}; equations have the labels"
_TEXT_WIDTH: Final = 480.0
"""The width of the text in points; figures side by side have a part of it."""
_HALF: Final = 220.0
_THIRD: Final = 145.0
_MOST_BOXED: Final = 12


@dataclass(frozen=True)
class ReportLatex(LatexWriter):
    """A report for pdflatex, or a fragment that a document of one's own takes in."""

    plot: str | None = None

    def report(self, title: str, sections: Iterable[Section]) -> str:
        """Return the whole document."""
        parts = [rf"\section*{{{breakable(title)}}}", *map(self.section, sections)]
        return whole_document("\n\n".join(part for part in parts if part), *_PACKAGES)

    def fragment(self, title: str, sections: Iterable[Section]) -> str:
        r"""Return what `\input` takes: a section with a label, its equations with labels."""
        parts = [rf"\section{{{breakable(title)}}}\label{{{self.prefix}}}", *map(self.section, sections)]
        head = f"{_NEEDS} {self.prefix}:1, {self.prefix}:2, ..\n"
        body = in_known_letters("\n\n".join(part for part in parts if part))
        return f"{head}\\begingroup\\sloppy\\setlength{{\\parindent}}{{0pt}}\n{body}\n\\par\\endgroup\n"

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return breakable(block.reason)
            case BlocksInLetters():
                return replace(self, notation=block.notation).section(Section("", block.blocks))
            case Document():
                writer = replace(self, notation=block.notation, command=r"\subsubsection*{%s}")
                return "\n".join(map(writer.section, block.sections)) or escaped(block.advice)
            case Boxed():
                return self._boxed(block)
            case Folded():
                inside = "\n".join(map(self.block, block.blocks))
                return f"\\subsection*{{{escaped(block.title)}}}\n{inside}"
            case Statement():
                return "\n\n".join(
                    " ".join([breakable(facts), rf"\textbf{{{breakable(asked)}}}" if asked else ""]).strip()
                    for facts, asked in block.paragraphs
                )
            case Pictures():
                return self._pictures(block.figures, block.title, _HALF if len(block.figures) > 1 else _TEXT_WIDTH)
            case Givens():
                each = (rf"\mbox{{{self.inline(name)} $=$ {self.words(value)}}}" for name, value in block.rows)
                return ", \\quad\n".join(each) + r"\par"
            case WordTable():
                return self._grid(block)
            case Film():
                size = r"width=\linewidth,height=0.45\textheight,keepaspectratio"
                plot = rf"\includegraphics[{size}]{{{self.plot}}}\par" if self.plot else ""
                return f"{self._pictures(block.stills, room=_THIRD)}\n{plot}"
            case Command():
                return rf"\texttt{{{breakable(block.text)}}}\par"
        return super().block(block)

    def _boxed(self, block: Boxed) -> str:
        inside = "\n".join(map(self.block, block.blocks))
        count = sum(len(getattr(each, "blocks", (each,))) for each in block.blocks)
        if count > _MOST_BOXED:
            return f"\\subsection*{{{escaped(block.title)}}}\n{inside}"
        box = r"\begin{minipage}{\dimexpr\linewidth-2\fboxsep-2\fboxrule\relax}"
        title = rf"\textbf{{{escaped(block.title)}}}\par"
        return f"\n\\medskip\\noindent\\fbox{{{box}\n{title}\n{inside}\n\\end{{minipage}}}}\\medskip\n"

    def _pictures(self, figures: Mapping[str, Figure], title: str = "", room: float = _TEXT_WIDTH) -> str:
        if not figures:
            return ""
        shown = "\n\\quad\n".join(self._picture(name, figure, room) for name, figure in figures.items())
        head = rf"\subsubsection*{{{title}}}" + "\n" if title else ""
        return f"{head}\\begin{{center}}\n{shown}\n\\end{{center}}"

    def _picture(self, name: str, figure: Figure, room: float) -> str:
        """Return a figure, one that is wider than its room scaled to it."""
        drawn = tikz(figure.picture, alone=False).strip()
        if figure.picture.width > room:
            drawn = rf"\scalebox{{{room / figure.picture.width:.3f}}}{{{drawn}}}"
        return rf"\shortstack{{{drawn}\\{escaped(name)}}}" if name else drawn

    def note(self, lines: Any) -> str:
        return "\n".join(breakable(line) + r"\par" for line in lines)

    def _grid(self, grid: WordTable) -> str:
        columns = "l" * max(map(len, grid.rows), default=1)
        head = [" & ".join(map(escaped, grid.head)) + r" \\ \hline"] if grid.head else []
        rows = [" & ".join(map(self.words, row)) + r" \\" for row in grid.rows]
        table = [rf"\begin{{longtable}}[l]{{@{{}}{columns}@{{}}}}", *head, *rows, r"\end{longtable}"]
        return "\n".join([rf"\subsubsection*{{{escaped(grid.title)}}}", *table])

