"""The chains of the benchmarks are of bodies that can exist, so that they can be derived."""

from __future__ import annotations

import derivation
import pytest

import multibody_sym as mbs


@pytest.mark.parametrize("kind", list(derivation.MODELS))
def test_chains_have_equations(kind: str) -> None:
    equations = mbs.derive(derivation.MODELS[kind](2), "composite_body")
    assert equations.mass_matrix.shape == (2, 2)
