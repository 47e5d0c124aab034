"""What closes at the start with a speed into it strikes: `solve`, `check` and the summary of a run say so."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text

THROWN = """
multibody_sym: 1
name: thrown
gravity: [0, -9.81, 0]
parameters: {{v: 2 m/s}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  block: {{mass: 2}}
joints: {{free: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: [{along}, {up}]}}}}}}
contacts: {{c1: {{between: [block, ground.floor], static: 0.3, kinetic: 0.3, restitution: {e}}}}}
"""


def thrown(along: str = "3", up: str = "-v", e: str = "0", more: str = "") -> mbs.System:
    return mbs.loads(THROWN.format(along=along, up=up, e=e) + more)


def test_solve_says_what_strikes_and_with_which_speed() -> None:
    found = mbs.solve(thrown())
    (speed,) = found.closing.values()
    assert (list(found.closing), speed.value, str(speed.expression), speed.unit) == (["c1"], 2.0, "v", "m/s")
    assert found.as_json()["closing"]["c1"]["value"] == 2.0
    (note,) = found.notes
    assert "c1 closes with 2 m/s" in note
    assert "impact: closing" in note
    assert "c1 strikes: it closes with v = 2 m/s (see the notes)" in solution_text(found).splitlines()[2]


@pytest.mark.parametrize("up", ["0", "v"])
def test_what_rests_or_leaves_strikes_nothing(up: str) -> None:
    found = mbs.solve(thrown(up=up))
    assert (dict(found.closing), found.notes) == ({}, ())
    assert "strikes" not in solution_text(found)


def test_check_says_what_strikes_and_what_then_counts() -> None:
    (hint,) = [hint for hint in mbs.check(thrown()).hints if "closes" in hint]
    assert "c1 closes with 2 m/s" in hint
    assert "impact: closing" in hint


@pytest.mark.parametrize(("e", "freedom", "word"), [("0", 1, "slide+"), ("0.5", 2, "open")])
def test_check_of_an_impact_is_of_what_goes_on_from_it(e: str, freedom: int, word: str) -> None:
    """A block that falls straight down on a rough floor stays or bounces; one that slides on does so in one way.

    u = 3 - 0.3 (1 + e) 2 stays positive.
    """
    found = mbs.check(thrown(e=e, more="impact: closing"))
    assert (found.degrees_of_freedom, dict(found.states)) == (freedom, {"c1": word})
    assert "all this is of the motion after the impact" in check_text(found)
    still = mbs.check(thrown(along="0", e=e, more="impact: closing"))
    assert still.degrees_of_freedom == (0 if e == "0" else 2)


def test_check_of_an_impact_with_a_prescribed_motion_that_jumps_says_that_it_is_of_what_was_before() -> None:
    """How the motion goes on after its jump is not declared; one with constraints alone goes on as it does."""
    file = """\
multibody_sym: 1
name: crank
bodies: {rod: {mass: 1, inertia: {Izz: 0.1}}}
joints: {drive: {type: revolute, parent: ground, child: rod, axis: z, motion: 2*t}}
impact: {motion: drive, speed: 2}
"""
    (hint,) = [hint for hint in mbs.check(mbs.loads(file)).hints if "impact" in hint]
    assert hint.startswith("all this is of the motion before the impact: the prescribed motion of drive jumps in it")


def test_an_impact_of_what_touches_and_leaves_says_that_it_opens() -> None:
    system = thrown(up="v", more="impact: closing")
    with pytest.raises(mbs.NoSolutionError, match="nothing strikes: c1 opens with 2 m/s"):
        mbs.solve(system)
    failure = mbs.check(system).failure
    assert failure is not None
    assert "nothing strikes: c1 opens with 2 m/s" in failure


@pytest.mark.parametrize("e", ["0", "0.5"])
def test_the_energy_account_of_a_run_begins_before_the_impact_at_its_start(e: str) -> None:
    """T = m (3^2 + 2^2)/2 = 13 J before; the impulse m (1 + e) v and its friction take the rest to u', e v."""
    run = mbs.simulate(thrown(e=e), t_end=0.15, rtol=1e-11, atol=1e-12)
    after = 3.0 - 0.3 * (1 + float(e)) * 2.0
    assert run.impact_losses["c1"] == pytest.approx(13.0 - (after**2 + (float(e) * 2) ** 2), rel=1e-9)
    assert abs(run.energy_residual) < 1e-9 * 13.0
    assert "total energy 13 J at the start" in run_summary(run)
