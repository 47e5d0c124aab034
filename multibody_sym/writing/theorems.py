"""How well the general theorems hold along a run, as text."""

from __future__ import annotations

from collections.abc import Mapping

from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.simulation.along.verified import Miss


def theorems_text(misses: Mapping[str, Miss], units: Units = SI) -> list[str]:
    """Return a line for each theorem: its largest miss beside the sum of absolute terms, and when."""
    width = max(map(len, misses))
    head = "theorems along the run (largest miss, relative to the sum of absolute terms):"
    words = {name: name.replace("_", " ") for name in misses}
    lines = (f"  {words[x]:{width}} {m.relative:.1e} at t = {units.said(m.t, 's', 6)}" for x, m in misses.items())
    return [head, *lines]
