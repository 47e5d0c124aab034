"""Withheld reactions in words: of which joints, which components, and what to declare so that they are determined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.expressions.quantities import force_name


def withheld_lines(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the names of joints' reactions that are not determined, then why; nothing for none."""
    if not withheld:
        return []
    named = (force_name(name, component) for name, components in withheld.items() for component in components)
    return [", ".join(named), *reasons]


def withheld_text(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the same as lines under a word of their own."""
    first, *others = withheld_lines(withheld, reasons) or [""]
    return [f"withheld: {first}", *(f"  {line}" for line in others)] if withheld else []
