"""How the name of a symbol is read as a book writes it: a letter or words, and what stands below it.

Formulas in LaTeX and MathML and the labels of figures all take it from here.
"""

from __future__ import annotations

import re
import unicodedata
from itertools import groupby
from typing import Final

GREEK: Final = dict(
    pair.split("=")
    for pair in (
        "alpha=α beta=β gamma=γ delta=δ epsilon=ε zeta=ζ eta=η theta=θ iota=ι kappa=κ lambda=λ mu=μ nu=ν xi=ξ pi=π "
        "rho=ρ sigma=σ tau=τ upsilon=υ phi=φ chi=χ psi=ψ omega=ω Gamma=Γ Delta=Δ Theta=Θ Lambda=Λ Xi=Ξ Pi=Π Sigma=Σ "
        "Upsilon=Υ Phi=Φ Psi=Ψ Omega=Ω"
    ).split()
)
"""The Greek letters that differ from Latin ones, by their names."""
_NAMES: Final = {letter: name for name, letter in GREEK.items()}
_LETTERS: Final = re.compile(r"([^\W\d_]*)_*(.*)", re.DOTALL)
SYMBOL: Final = re.compile(r"[^\W\d_]\w*")
"""What is a symbol: other names are read as they stand."""
_LOW: Final = {0x2080 + digit: str(digit) for digit in range(10)}


def read_parts(name: str) -> list[str]:
    """Return the letter or words of a name and what stands below it, theta1 and θ₁ as theta and 1.

    Words that follow each other are read as one, crank_angle_2 as crank angle and 2. Greek letters have their names.
    """
    plain = unicodedata.normalize("NFC", name).translate(_LOW)
    letter, rest = _LETTERS.match(plain).groups()  # type: ignore[union-attr]
    if not letter:
        return [name]
    words, parts = [_NAMES.get(letter, letter)], [_NAMES.get(part, part) for part in rest.split("_") if part]
    while is_word(words[0]) and parts and is_word(parts[0]):
        words.append(parts.pop(0))
    runs = [(word, list(run)) for word, run in groupby(parts, is_word)]
    return [" ".join(words), *(part for word, run in runs for part in ([" ".join(run)] if word else run))]


def is_word(part: str) -> bool:
    """Return whether a part of a name is a word and no letter or number."""
    return len(part) > 1 and part.isalpha() and part not in GREEK
