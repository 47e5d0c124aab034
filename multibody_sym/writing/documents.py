r"""Whole documents: LaTeX that compiles as it is, and HTML that needs nothing beside it."""

from __future__ import annotations

from html import escape
from typing import Final

from multibody_sym.dynamics.derivation.notation import breakable
from multibody_sym.writing.formulas.signs import declared, harmless

_PREAMBLE: Final = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{amsmath}
\usepackage{graphicx}
\usepackage[margin=2cm]{geometry}
\allowdisplaybreaks
\setcounter{secnumdepth}{0}
\setcounter{MaxMatrixCols}{99}
\setlength{\parindent}{0pt}
\sloppy
"""
FIT: Final = (
    r"\newcommand{\fit}[1]{\resizebox{\ifdim\width>0.93\linewidth 0.93\linewidth\else\width\fi}{!}{$\displaystyle #1$}}"
)
"""A line of mathematics, set smaller where it is too wide for the page."""
_PAGE: Final = (
    "body{max-width:60em;margin:2em auto;padding:0 1em;font-family:serif}.n{float:right}"
    "p{overflow-x:auto;overflow-y:hidden}.formula{padding-left:2em;text-indent:-2em}math{text-indent:0}"
)


def latex_document(title: str, body: str) -> str:
    r"""Return a LaTeX document around a body that needs amsmath and `\fit` only."""
    return whole_document(f"{_PREAMBLE}{FIT}", f"\\section*{{{breakable(title)}}}\n{body.rstrip()}")


def whole_document(preamble: str, body: str) -> str:
    """Return a LaTeX document whose letters pdflatex knows or is told of."""
    body = harmless(body)
    return f"{preamble}\n{declared(body)}\n\\begin{{document}}\n{body}\n\\end{{document}}\n"


def html_document(title: str, body: str) -> str:
    """Return a page of HTML with its style around a body."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_PAGE}</style>'
    body = f"<h1>{escape(title)}</h1>\n{body}"
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}</body></html>\n'
