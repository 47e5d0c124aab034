"""Published cases: each value is that of its source within the source's accuracy, and stands so on the page."""

from __future__ import annotations

import pytest
from published_files import comparisons, published_cases, read_published
from site_pages import verification

SHOWN = verification.PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", published_cases())
def test_a_published_case_comes_out(name: str) -> None:
    case = read_published(published_cases()[name])
    values = list(comparisons(case))
    for one in values:
        assert one.difference <= one.accuracy, one
    shown, today = (
        [line.split(" | ") for line in text.splitlines() if line.startswith("| ")]
        for text in (part_of_page(case.title), verification.section(case, values))
    )
    again = "PYTHONPATH=docs python -m site_pages writes docs/verification.md anew"
    assert [[cells[0], cells[1], cells[-1]] for cells in shown] == [[c[0], c[1], c[-1]] for c in today], again
    for cells, one in zip(shown[2:], values, strict=True):
        assert float(cells[2]) == pytest.approx(one.ours, abs=0.02 * one.accuracy), again


def part_of_page(title: str) -> str:
    """Return the part of the page below a title."""
    return SHOWN.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def test_the_page_has_every_case_and_no_other() -> None:
    titles = [read_published(path).title for path in published_cases().values()]
    assert [line.removeprefix("## ") for line in SHOWN.splitlines() if line.startswith("## ")] == titles
    assert len({*titles}) == len(titles)
