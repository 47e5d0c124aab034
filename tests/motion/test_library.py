"""Methods of other libraries: accuracy, events, and what is said where they cannot be had."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from test_loop import AMPLITUDE, pendulum, pendulum_angle

from multibody_sym.errors import MissingPackageError
from multibody_sym.motion.integrator.flow import Events, Flow, StepError, ordinary
from multibody_sym.motion.integrator.loop import steps
from multibody_sym.motion.methods.table import LIBRARY, METHODS, SUNDIALS
from multibody_sym.program.runtime_constants import Status


@pytest.fixture(params=LIBRARY)
def method(request):
    made = METHODS[request.param]
    if made.package == SUNDIALS:
        pytest.importorskip("sksundae")
    return made


def flow(method, derivative=pendulum, t_end=5.0, **options):
    start = np.array([AMPLITUDE, 0.0])
    stages = ordinary(derivative, pendulum_jacobian if derivative is pendulum else lambda t, x: np.zeros((2, 2)))
    return Flow(method, derivative, 0.0, t_end, start, rtol=1e-8, atol=1e-8, stages=stages, **options)


def pendulum_jacobian(t, x):
    return np.array([[0.0, 1.0], [-np.cos(x[0]), 0.0]])


def test_a_pendulum_swings_as_elliptic_functions_say(method) -> None:
    taken = list(steps(flow(method)))
    assert taken[-1].t_new == 5.0
    for done in taken:
        assert done.x_new[0] == pytest.approx(pendulum_angle(done.t_new), abs=2e-5)


def test_between_steps_too(method) -> None:
    for done in steps(flow(method)):
        inside = done.value(0.3)
        assert inside[0] == pytest.approx(pendulum_angle(done.t + 0.3 * done.h), abs=2e-5)


def test_events_end_steps_where_they_are(method) -> None:
    """It passes 1 and then 0 on its way down; the second one stops it."""
    events = Events(lambda _, x: np.array([x[0] - 1.0, -x[0]]), (False, True))
    taken = list(steps(flow(method, events=events)))
    kink, stop = (done for done in taken if done.event is not None)
    assert (kink.event, stop.event) == (0, 1)
    assert kink.x_new[0] == pytest.approx(1.0, abs=1e-12)
    assert stop.x_new[0] == pytest.approx(0.0, abs=1e-12)
    assert pendulum_angle(stop.t_new) == pytest.approx(0.0, abs=2e-5)
    assert taken[-1] is stop


def test_what_is_not_finite_is_met(method) -> None:
    def root(t, x):
        return np.array([0.0, np.sqrt(0.5 - t)])

    with np.errstate(invalid="ignore"), pytest.raises(StepError) as met:
        list(steps(flow(method, root, 1.0)))
    assert met.value.status in (Status.NOT_FINITE, Status.STEP_UNDERFLOW)
    assert met.value.time <= 1.0


@pytest.mark.parametrize(("name", "module"), [("cvode_bdf", "cvode"), ("ida", "ida")])
def test_a_missing_package_is_named(name, module, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, f"sksundae.{module}", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'multibody-sym\[sundials\]'"):
        list(steps(flow(METHODS[name])))
