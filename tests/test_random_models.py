"""Random model files are read; a hundred of unlike kinds and options are checked, some run; the long run gives more to
commands."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from random_models import KINDS, random_model
from random_runs import judged_run, main, rows_of, seed_of

import multibody_sym as mbs
from multibody_sym.analysis import check as checking
from multibody_sym.motion.runs.run import FailedRunError, MotionEndsError

REFUSED = {"answer", "refusal"}
RUN = (
    24, 141, 175, 219, 250, 279, 294, 314, 332, 365, 443, 498, 507, 537, 541,
)
"""Models of the text `first` whose runs are soon made ready: they are checked and run."""
CHECKED = (
    5, 7, 8, 13, 22, 29, 44, 53, 59, 62, 63, 66, 68, 75, 80, 86, 89, 98, 107, 127, 146, 147, 152, 169, 171, 184, 198,
    208, 212, 215, 217, 223, 227, 231, 232, 234, 236, 243, 246, 248, 259, 260, 261, 274, 275, 282, 284, 285, 291, 297,
    305, 306, 307, 317, 327, 346, 350, 359, 363, 366, 367, 372, 374, 379, 388, 402, 403, 410, 411, 421, 425, 436, 445,
    448, 468, 481, 491, 500, 501, 506, 520, 529, 536, 538, 540,
)
"""Models of that text that are checked alone."""


def test_files_are_read_and_hold_every_kind() -> None:
    kinds = set()
    for number in range(60):
        text = random_model(seed_of("read", number))
        kinds |= {kind for kind in KINDS if kind in text.splitlines()[1]}
        assert mbs.mechanism(mbs.loads(text)).bodies
    assert kinds == set(KINDS)


def test_the_hundred_hold_every_kind() -> None:
    names = {random_model(seed_of("first", number)).splitlines()[1] for number in (*RUN, *CHECKED)}
    assert len(names) == 100
    assert [kind for kind in (*KINDS, "loop") if not any(kind in name for name in names)] == []


@pytest.mark.parametrize("number", sorted((*RUN, *CHECKED)))
def test_routes_and_theorems_agree_and_runs_keep_their_account(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Conserved quantities have no say in what agrees, and take a third of the time."""
    monkeypatch.setattr(checking, "find_conserved", lambda *_: [])
    system = mbs.loads(random_model(seed_of("first", number)))
    report = mbs.check(system)
    assert report.agrees, report.missing
    if number in RUN:
        run = mbs.simulate(system, t_end=0.1, samples=11)
        assert judged_run(run.as_json(), 0.1)["class"] == "answer"


def test_a_light_link_of_a_rigid_loop_is_no_singular_position() -> None:
    """A load that slides on a link a thousandth as heavy, in a loop with redundant rows of m and rad that stands."""
    run = mbs.simulate(mbs.loads(random_model(seed_of("fb09cb2a", 795))), t_end=1.0, samples=11)
    assert judged_run(run.as_json())["class"] == "answer"
    assert run.statistics["steps"] < 300


def test_declared_speeds_that_close_a_rigid_loop_are_kept() -> None:
    """The least change by mass moves its joint by 1e-14 rad/s, more than the rounding of its smallest row."""
    system = mbs.loads(random_model(seed_of("fb09cb2a", 380)))
    report = mbs.check(system)
    assert report.failure is None
    assert report.agrees, report.missing


@pytest.mark.parametrize("t_end", [0.006, 1.0])
def test_a_box_that_stops_spinning_on_its_corners_rests(t_end: float) -> None:
    """It neither jams nor rocks for ever on the rounding of its gaps: statics holds it, as 1.5*2.27*9.81 > 23.65 N, and
    23.65*0.147 N*m do not tip it. With other ends of the run it took other steps."""
    seed = seed_of("67366ace774f20e61a63b3da1196b57649146c35", 1669)
    run = mbs.simulate(mbs.loads(random_model(seed)), t_end=t_end, samples=5)
    assert judged_run(run.as_json(), t_end)["class"] == "answer"
    assert not run.u[-1].any()
    last = {event["element"]: event["kind"] for event in run.events}
    assert {last[f"c1.corner{k}"] for k in range(1, 5)} <= {"stick", "impact"}
    assert run.events[-1]["t"] < 0.00432


@pytest.mark.long
def test_commands_answer_or_refuse(tmp_path: Path) -> None:
    table = tmp_path / "table"
    main([str(table), "--seed", os.environ.get("RANDOM_MODELS", "0"), "--models", "200", "--folder", str(tmp_path)])
    assert [row for row in rows_of(table) if row["class"] not in REFUSED] == []


@pytest.mark.parametrize(
    ("seed", "words"),
    [
        (477542502, "u_j4_z grows without bound there: .* f1 drives it"),
        (1593700769, "u_j5_z grows without bound there: .* f0 drives it"),
        (3188447798, "next to nothing resists u_b2_q there, which grows without bound: b2 and b3, without mass"),
    ],
)
def test_motions_that_end_beside_friction_name_why(seed: int, words: str) -> None:
    """A drag that drives, a spring as stiff as it is fast, links that come into line: no friction jams there."""
    with pytest.raises(MotionEndsError, match=words) as met:
        mbs.simulate(mbs.loads(random_model(seed)), t_end=1.0)
    assert met.value.number == "R101"


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (1085, "at t = .* b2 and b3, without mass, come into line"),
        (166, r"t = .* b1\.a and ground\.b meet there, and f2 between them"),
    ],
)
def test_what_has_vanished_is_named_where_a_run_ends(number: int, words: str) -> None:
    """At speeds of 4 rad/s and 1 m/s nothing grows yet: a mass vanishes, and a direction.

    Whether steps become small, too many, or meet no finite number there is rounding of the machine's own sine.
    """
    with pytest.raises(FailedRunError, match=words):
        mbs.simulate(mbs.loads(random_model(seed_of("cc544163841cf644b57d75632377b40ed4e5e622", number))), t_end=1.0)


@pytest.mark.parametrize(
    ("seed", "number", "until"),
    [
        ("40471c2d0d96cb6ebeb563f89eeeb5856bae7657", 343, 0.0055),
        ("628b45305d92fa28a8a466796137caacd2c630e5", 1465, 0.0065),
    ],
)
def test_what_slides_and_spins_comes_to_rest_though_who_presses_is_not_unique(
    seed: str, number: int, until: float
) -> None:
    """A crate and a plate on seven feet: below 1e-5 m/s their shares were chosen anew each 1e-15 s, to no end."""
    run = mbs.simulate(mbs.loads(random_model(seed_of(seed, number))), t_end=until, samples=3)
    speeds = [run.final["speeds"][name] for name in ("u_j1_x", "u_j1_y", "u_j1_z", "j1_wx", "j1_wy", "j1_wz")]
    assert speeds == [0.0] * 6
    assert abs(run.energy_residual) < 1e-10


def test_what_strikes_at_the_end_of_a_mode_is_no_work_of_friction() -> None:
    """A block on a rope over a drum with a rough pin strikes a stop 2e-14 s after the rope: 0.13 of 109 J."""
    run = mbs.simulate(mbs.loads(random_model(seed_of("7f6d9351603aa0ddf575e1a05d91e6216ac6f254", 321))), t_end=0.45)
    assert abs(run.energy_residual) < 1e-9


def test_a_tip_that_friction_stops_at_once_stops_whole() -> None:
    """All of a pendulum moves together: its impact went on with 3e-17 m/s, which no impulse with its friction stops."""
    run = mbs.simulate(mbs.loads(random_model(seed_of("7f6d9351603aa0ddf575e1a05d91e6216ac6f254", 1422))), t_end=0.6)
    assert [(event["element"], event["kind"]) for event in run.events] == [("c1", "stick")]
    assert run.u[-1].tolist() == [0.0]
    assert abs(run.energy_residual) < 1e-9


@pytest.mark.parametrize("until", [0.64, 1.0])
def test_friction_that_jams_at_the_end_of_a_mode_is_in_the_account_to_its_end(until: float) -> None:
    """A foot whose friction grows without bound in 0.6 ms takes 1e-5 J in the last 5e-9 s."""
    system = mbs.loads(random_model(seed_of("40471c2d0d96cb6ebeb563f89eeeb5856bae7657", 1048)))
    runs = [mbs.simulate(system, t_end=until, rtol=rtol) for rtol in (1e-9, 1e-11)]
    assert [abs(run.energy_residual) < 1e-7 for run in runs] == [True, True]
    took, nearer = (run.friction_work["c2"].total for run in runs)
    assert took == pytest.approx(nearer, abs=1e-8)
    assert runs[0].friction_work["c2"].bodies["b1"] == pytest.approx(took, abs=1e-12)


@pytest.mark.parametrize(
    ("seed", "until"), [(1472071181, 0.2), (2246061038, 0.4), (2324990770, 0.18), (3388858395, 0.5)]
)
def test_slip_that_friction_stops_at_once_is_an_impact(seed: int, until: float) -> None:
    """Energy tells: friction took what is missing, before the impact and in it, down to 1e-6 of it."""
    run = mbs.simulate(mbs.loads(random_model(seed)), t_end=until)
    assert run.t[-1] == until
    assert sum(run.impact_losses.values()) > 1.0
    scale = float(np.abs(run.outputs["E"]).max()) + sum(run.impact_losses.values())
    assert run.energy_residual == pytest.approx(0.0, abs=1e-6 * scale)


def test_feet_that_stay_by_a_pull_do_not_rub_meanwhile() -> None:
    """Friction of what pulls would jam the feet: an impact of 6e-3 N s booked 1.8e-4 J that nobody had lost."""
    run = mbs.simulate(mbs.loads(random_model(3271399235)), t_end=0.751)
    assert run.energy_residual == pytest.approx(0.0, abs=1e-7 * sum(run.impact_losses.values()))


def test_what_any_force_would_hold_opens_beside_a_rough_wheel() -> None:
    """A block is lifted off another one: N = m g cos a - P sin(w t) cos a - k (3 m - 0.1 m) vanishes."""
    run = mbs.simulate(mbs.loads(random_model(2808982942)), t_end=0.5, samples=3)
    ((t, kind, name),) = ((x["t"], x["kind"], x["element"]) for x in run.events)
    assert (kind, name) == ("open", "c2")
    rises = (5.48 * 9.81 * math.cos(0.2) - 12.659 * 2.9) / (31.207 * math.cos(0.2))
    assert t == pytest.approx(math.asin(rises) / 1.526, rel=1e-9)


def test_what_stops_sticks_beside_what_any_force_would_hold() -> None:
    """A bead stops on a rod whose tip slides on a wall that hardly presses: it began to slip again either way."""
    run = mbs.simulate(mbs.loads(random_model(1511432065)), t_end=0.3, samples=3)
    assert run.events[0]["t"] < 0.0662 < run.events[1]["t"] < 0.0663
    assert (run.events[1]["kind"], run.events[1]["element"]) == ("stick", "rub1")
    assert run.energy_residual == pytest.approx(0.0, abs=1e-7)


def test_a_loop_with_a_dependent_row_and_a_rough_joint_is_put_back_by_the_others() -> None:
    """Of its three rows two are independent where it closes, three beside it; reactions that rub are no such rows.

    Put back by all three it was lost at some instant, which depended on the tolerance.
    """
    system = mbs.loads(random_model(seed_of("936bc6ca6f75281eaa7206fb5acdca0c4314e09a", 450)))
    runs = [mbs.simulate(system, t_end=1, rtol=rtol) for rtol in (1e-9, 5e-10)]
    assert runs[0].q[-1] == pytest.approx(runs[1].q[-1], abs=1e-6)
    assert abs(runs[0].energy_residual) < 1e-7


def test_an_impact_past_friction_in_several_places_is_told_as_not_found() -> None:
    """Not all directions of slip in space are tried there."""
    model = random_model(seed_of("f817f8b9c15021c4dd7e4749d91ecaba0d1a8011", 1525))
    with pytest.raises(FailedRunError, match=r"no way was found .* impact at j5\.lower goes on .* tried were"):
        mbs.simulate(mbs.loads(model), t_end=0.1, samples=3)
