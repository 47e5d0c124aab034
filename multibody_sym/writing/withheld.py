"""Withheld reactions in words: of which joints, which components, and what to declare so that they are determined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def withheld_lines(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the joints with the components of their reactions that are not determined, then why; nothing for none."""
    if not withheld:
        return []
    return [", ".join(f"{name} ({' '.join(components)})" for name, components in withheld.items()), *reasons]


def withheld_text(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the same as lines under a word of their own."""
    first, *others = withheld_lines(withheld, reasons) or [""]
    return [f"withheld: {first}", *(f"  {line}" for line in others)] if withheld else []
