"""Chains: a run that goes on in another problem where a switching function says so, by both loops."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from hand_models import HandModel

from multibody_sym.motion.integrator.loop import steps_before
from multibody_sym.motion.loop import integrate as chains
from multibody_sym.motion.loop.integrate import End, Leg, chain, integrate
from multibody_sym.motion.loop.native_loop import native_loop
from multibody_sym.motion.loop.problem import NO_MODE, Problem, RunFailure
from multibody_sym.motion.loop.python_loop import python_loop
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program.runtime_constants import Status

LOOPS = pytest.mark.parametrize("loop", [native_loop, python_loop])
G, E = 9.81, 0.5
BOUNCING = HandModel(
    1, 1, 2, "out[0][0] = u[0]; out[1][0] = -p[0];", ng=2,
    others=(("events", "out[0][0] = t - p[1]; out[0][1] = -q[0];"),),
)  # fmt: skip
# a block at rest: what holds it has p[0] left but for a force that comes as a pulse at p[1]
PRESSED = HandModel(
    1, 1, 2, "out[0][0] = 0.0; out[1][0] = 0.0;", ng=1,
    others=(("events", "out[0][0] = exp(-(t - p[1])*(t - p[1])/0.02) - p[0];"),),
)  # fmt: skip


def dropped(loop, onward, monkeypatch, stop=99.0, method="dormand_prince", **options):
    for name in ("first_loop", "loop_for"):
        monkeypatch.setattr(chains, name, lambda problem: loop)
    start = (np.array([1.0]), np.zeros(1), np.array([G, stop]), NO_MODE)
    terminal = {"terminal": (True, True), "margins": (0.0,)}
    problem = Problem(BOUNCING.load(), METHODS[method], 0.0, 1.2, *start, **terminal, **options)
    legs = [Leg(problem)]
    return integrate(problem, loop=chain(onward, legs)), legs


def bounced(leg, switch):
    q, u = np.zeros(1), -E * switch.x[1:]
    return Leg(replace(leg.of, q0=q, u0=u, begun=switch.begun))


def height(t):
    """Return the height of a ball that falls from 1 m and bounces with E."""
    fall, begin, speed = math.sqrt(2 / G), 0.0, 0.0
    if t <= fall:
        return 1 - G / 2 * t * t
    begin, speed = fall, E * G * fall
    while t > begin + 2 * speed / G:
        begin, speed = begin + 2 * speed / G, E * speed
    return speed * (t - begin) - G / 2 * (t - begin) ** 2


@LOOPS
@pytest.mark.parametrize(("method", "step"), [("dormand_prince", None), ("rk4", 0.013), ("heun", 0.013)])
def test_a_ball_bounces_through_a_chain_with_its_samples_evenly_spaced(loop, method, step, monkeypatch):
    run, legs = dropped(loop, bounced, monkeypatch, method=method, step=step, samples=301)
    assert run.status is Status.DONE
    np.testing.assert_array_equal(run.t, np.arange(301) * 1.2 / 300)
    np.testing.assert_allclose(run.q[:, 0], [height(t) for t in run.t], atol=1e-12)
    fall = math.sqrt(2 / G)
    struck = fall * np.cumsum([1.0, 2 * E, 2 * E**2, 2 * E**3])
    assert [leg.until for leg in legs[:-1]] == pytest.approx([t for t in struck if t < 1.2], rel=1e-14)
    assert [leg.first for leg in legs[1:]] == [leg.end for leg in legs[:-1]]
    assert run.events == ()
    assert run.statistics.steps == pytest.approx(1.2 / run.statistics.mean_step)
    if step is not None:
        assert run.statistics.steps == 93 + len(legs) - 1


@LOOPS
def test_a_stop_ends_a_chain_in_the_mode_it_is_in(loop, monkeypatch):
    run, legs = dropped(loop, bounced, monkeypatch, stop=0.777, samples=13)
    assert run.status is Status.STOPPED
    assert run.t_final == run.t[-1] == pytest.approx(0.777, rel=1e-15)
    assert run.q_final[0] == pytest.approx(height(0.777), rel=1e-13)
    assert (len(run.t), len(legs)) == (9, 2)


@LOOPS
def test_a_chain_that_cannot_go_on_keeps_what_it_had(loop, monkeypatch):
    failure = RunFailure(Status.NO_MODE, 0.4, None)
    run, _ = dropped(loop, lambda leg, switch: End(failure), monkeypatch, samples=13)
    assert run.failure == failure
    assert run.t_final == pytest.approx(math.sqrt(2 / G), rel=1e-14)
    assert len(run.t) == 5


def test_both_loops_take_the_same_chain(monkeypatch):
    first, other = (dropped(loop, bounced, monkeypatch, samples=50)[0] for loop in (native_loop, python_loop))
    assert (first.q == other.q).all()
    assert first.statistics == other.statistics


@LOOPS
def test_the_side_of_a_switching_function_is_that_of_the_mode_whatever_its_value(loop, monkeypatch):
    """A ball that starts to fall on the floor, and one that is sunk by its margin or less: both strike at once."""
    for sunk, margin in ((0.0, 0.0), (1e-13, 1e-12)):
        start = (np.array([-sunk]), np.zeros(1), np.array([G, 99.0]), NO_MODE)
        given = {"terminal": (True, True), "margins": (margin,), "samples": 3}
        problem = Problem(BOUNCING.load(), METHODS["dormand_prince"], 0.0, 1.0, *start, **given)
        run = integrate(problem, loop=loop)
        assert run.t_final < 2e-6
        assert len(run.t) == 1


@pytest.mark.parametrize("when", [0.93, 37.3, 71.0])
def test_a_pulse_is_not_stepped_over_by_what_stands_still(when):
    """The block has no rate and no error; its friction would be at its limit where the pulse reaches 0.9.

    The pulse takes about two thousandths of the run.
    """
    start = (np.zeros(1), np.zeros(1), np.array([0.9, when]), NO_MODE)
    runs = []
    for loop in (native_loop, python_loop):
        given = {"terminal": (True,), "margins": (0.0,), "limiting": (0,), "samples": 5}
        problem = Problem(PRESSED.load(), METHODS["dormand_prince"], 0.0, 100.0, *start, **given)
        runs.append(integrate(problem, loop=loop))
    assert runs[0].t_final == pytest.approx(when - math.sqrt(-0.02 * math.log(0.9)), rel=1e-13)
    assert runs[1].t_final == runs[0].t_final
    assert runs[1].statistics == runs[0].statistics


def test_whole_steps_before_a_time():
    for count in (0, 1, 7, 1234567):
        time_ = 0.3 + count * 0.1
        assert steps_before(0.3, time_, 0.1) == count
        assert steps_before(0.3, math.nextafter(time_, 9e9), 0.1) == count
        assert steps_before(0.3, math.nextafter(time_, 0.0), 0.1) == count - 1


def test_a_switch_costs_little(monkeypatch):
    """A thousand bounces of a ball that loses nothing: most of the time of a switch is building C's structures."""

    def again(leg, switch):
        return Leg(replace(leg.of, q0=np.zeros(1), u0=np.array([0.01]), begun=switch.begun))

    began = time.process_time()
    _, legs = dropped(native_loop, again, monkeypatch)
    assert len(legs) > 300
    assert (time.process_time() - began) / len(legs) < 2e-3


@LOOPS
def test_what_must_have_been_below_its_margin_ends_nothing_before(loop):
    """The ball starts at rest 1e-3 above the floor of which it must have been 0.5 away: it rises, and stops there."""
    start = (np.array([1e-3]), np.array([5.0]), np.array([G, 99.0]), NO_MODE)
    given = {"terminal": (True, True), "margins": (-0.5,), "samples": 3}
    problem = Problem(BOUNCING.load(), METHODS["dormand_prince"], 0.0, 2.0, *start, **given)
    run = integrate(problem, loop=loop)
    assert run.t_final == pytest.approx((5 + math.sqrt(25 - 2 * G * 0.499)) / G, rel=1e-13)
