"""Every example moves alike in coordinates of its joints and in absolute ones, and its file says either."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from twins import FILES, from_file

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.mechanics.changes import with_settings
from multibody_sym.model.fields import Names

LARGE = ("andrews_squeezer", "bicycle", "chain", "gyroscope", "spatial_chain", "spatial_four_bar", "stewart_platform")
STIFF = {"elastic_rod": "push"}
"""A force of 1e8 N/m, which shows the error of coordinates 1e8 times."""
ALIKE = [name for name, path in FILES.items() if path.parent.name == "textbook"]
"""Problems with blocks, planes and contacts, like each other: one of three is run always, as of others."""
STAGED = [name for name, path in FILES.items() if path.parent.name == "stages"]
"""Motions of several stages are in coordinates of joints alone."""
OTHERS = [name for name in FILES if name not in {*LARGE, *ALIKE, *STAGED}]
LATER = {*LARGE, *ALIKE[1::3], *ALIKE[2::3], *OTHERS[1::3], *OTHERS[2::3]}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long) if n in LATER else n for n in FILES if n not in STAGED]
)
def test_an_example_moves_alike(name: str) -> None:
    system = from_file(name)
    t_end = 0.001 if name == "andrews_squeezer" else 0.02
    settings = {} if name in STIFF else {"rtol": 1e-11, "atol": 1e-13}
    if FILES[name].parent.name in ("textbook", "impacts", "feet"):  # an adaptive run looks often where one may stick
        settings = {"method": "rk4", "step": t_end / 20}
    relative, absolute = (
        mbs.simulate(system, coordinates=which, t_end=t_end, samples=3, backend="python", **settings)
        for which in ("relative", "absolute")
    )
    for column in (*relative.coordinates, *relative.speeds, *system.outputs):
        if column != STIFF.get(name):
            size = 1 + np.abs(relative[column]).max()
            error = (1e-5 if name in STIFF else 1e-8) * size
            assert absolute[column] == pytest.approx(relative[column], abs=error), column
    assert set(absolute.reactions) == set(relative.reactions)


@pytest.mark.parametrize("name", ["slider_crank", "furuta", "chaplygin_sleigh"])
def test_reactions_and_drives_are_the_same(name: str) -> None:
    """Of joints with motors, of loops, and of a joint along which a nonholonomic constraint acts."""
    system = from_file(name)
    relative, absolute = (
        mbs.simulate(system, coordinates=which, t_end=0.01, samples=2, backend="python", rtol=1e-10)
        for which in ("relative", "absolute")
    )
    for joint, components in relative.reactions.items():
        for component, values in components.items():
            assert absolute.reactions[joint][component] == pytest.approx(values, abs=1e-6), (joint, component)


def test_a_file_with_absolute_coordinates_reads_as_it_was_written() -> None:
    system = with_settings(from_file("four_bar"), {"coordinates": "absolute"})
    assert "coordinates: absolute" in mbs.dumps(system)
    assert mbs.loads(mbs.dumps(system)) == system


def test_routes_and_theorems_agree(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(FILES["slider_crank"]), "--coordinates", "absolute", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["degrees_of_freedom"] == 1
    assert found["agrees"]
    assert found["redundant"] == []  # what a plane cannot feel is no row there


def test_small_motions_and_equilibria_are_the_same() -> None:
    """A pendulum hangs down stably and swings with sqrt(g/l), l = 1 m; upright it is in equilibrium too."""
    declared = from_file("pendulum")
    hinge = replace(declared.joints["hinge"], initial={"q": 0})
    system = replace(declared, joints=Names({"hinge": hinge}), simulation={"coordinates": "absolute"})
    found = mbs.equilibrium(system)
    angles = [abs(position["bob_angle"]) for position in found.positions]
    assert dict(zip(np.round(angles, 9).tolist(), found.stable, strict=True)) == {0.0: True, 3.141592654: False}
    swinging = mbs.linearize(system).eigenvalues
    assert swinging == pytest.approx(mbs.linearize(with_settings(system, {"coordinates": "relative"})).eigenvalues)
    assert abs(swinging.imag) == pytest.approx([np.sqrt(9.81)] * 2)


def test_a_word_that_is_no_choice_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", str(FILES["pendulum"]), "--coordinates", "abs"]) == 2
    assert "--coordinates: 'abs' is no choice here; known: relative, absolute" in capsys.readouterr().err


def test_questions_are_answered_in_coordinates_of_joints() -> None:
    system = from_file("t7_atwood")
    assert mbs.solve(with_settings(system, {"coordinates": "absolute"})).as_json() == mbs.solve(system).as_json()
