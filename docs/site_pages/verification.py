"""The page of published cases: the values of each one's source beside those of its run."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from site_pages.gallery import ROOT
from site_pages.markdown import anchor, cell, plain, table

if (tests := str(ROOT / "tests")) not in sys.path:
    sys.path.insert(0, tests)

from published_files import Comparison, PublishedCase, comparisons, published_cases, read_published

PAGE = ROOT / "docs" / "verification.md"
QUANTITIES = ("quantity", "reference", "ours", "difference", "accuracy")
_HEAD = """# Verification

These machines come from the tests of other programs and from collections of benchmarks. Each is a model file in
`tests/published`, which a test runs. `PYTHONPATH=docs python -m site_pages` writes this page from their runs.

The reference is the source's value, or a closed form where there is one. The accuracy is how good the reference is.
A smaller difference is agreement. The overview has the largest difference of each case in parts of its accuracy.
All numbers are in SI units.
"""
_PARTS = 1000
"""Differences below this part of the accuracy are printed as smaller than it: they depend on the compiler."""


def page() -> str:
    """Run all cases and return the page."""
    cases = [read_published(path) for path in published_cases().values()]
    return written([(case, list(comparisons(case))) for case in cases])


def written(found: Sequence[tuple[PublishedCase, Sequence[Comparison]]]) -> str:
    """Return the page of cases and their values."""
    heads = ("case", "tests", "values", "largest difference / accuracy")
    overview = table(heads, [_summary(case, values) for case, values in found])
    return "\n".join([_HEAD, overview, *(section(case, values) for case, values in found)])


def _summary(case: PublishedCase, values: Sequence[Comparison]) -> tuple[str, ...]:
    worst = max(one.difference / one.accuracy for one in values)
    part = f"{worst:.1g}" if worst >= 1 / _PARTS else f"< {1 / _PARTS:g}"
    return f"[{plain(case.title)}](#{anchor(case.title)})", cell(case.tests), str(len(values)), part


def section(case: PublishedCase, values: Sequence[Comparison]) -> str:
    """Return the part of the page about a case."""
    parts = [f"## {plain(case.title)}\n", f"Source: {plain(case.source)}. Accuracy: {plain(case.accuracy)}.\n"]
    parts.append(table(QUANTITIES, map(row, values)))
    if case.left_out:
        parts.append(f"Not compared: {plain(case.left_out)}\n")
    return "\n".join(parts)


def row(one: Comparison) -> tuple[str, ...]:
    """Return the cells of a value, its digits as far as a hundredth of its accuracy."""
    digits = min(12, max(0, 2 - math.floor(math.log10(one.accuracy))))
    least = one.accuracy / _PARTS
    difference = f"{one.difference:.0e}" if one.difference >= least else f"< {least:.0e}"
    return (
        cell(one.quantity), f"{one.reference:.{digits}f}", f"{one.ours:.{digits}f}", difference, f"{one.accuracy:.1g}"
    )
