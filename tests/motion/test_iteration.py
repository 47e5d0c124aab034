"""Where the iteration for the stages of implicit steps ends: beside round-off, and from no prediction."""

import numpy as np

from multibody_sym.motion.integrator.flow import Flow, ordinary
from multibody_sym.motion.integrator.runge_kutta_steps import CollocationStepper
from multibody_sym.motion.methods.table import METHODS

RADAU_5 = METHODS["radau_5"]


def stepper(f, x0, tolerance, **how):
    """Return steps from x0 of x' = f(t, x) by mere iteration: without a Jacobian."""
    stages = ordinary(f, lambda t, x: np.zeros((len(x), len(x))))
    flow = Flow(RADAU_5, f, 0.0, 1.0, np.array(x0), rtol=tolerance, atol=tolerance, stages=stages, **how)
    return CollocationStepper(RADAU_5.scheme, flow)


def test_an_iteration_that_moves_by_no_more_than_round_off_is_at_rest():
    """Slopes that are wrong by 1e-9 keep stages moving by more than the tolerance, which is not to stop the run."""
    chance = np.random.default_rng(1)

    def even(t, x):
        return 1.0 + chance.uniform(-1e-9, 1e-9, len(x))

    x0 = np.ones(4)
    for h in (0.02, 0.03, 0.04):
        taking = stepper(even, x0, 1e-12, noise=lambda: 1e-9)
        trial = taking.attempt(0.0, x0, np.ones(4), h, h)
        np.testing.assert_allclose(trial.x_new, 1.0 + h, rtol=0.0, atol=1e-9 * h)


def test_the_first_change_of_a_step_that_nothing_predicts_tells_nothing_of_what_it_leaves():
    """Each component moves a round after the one before it; x = t, e t^2/2, g e t^3/6, for which radau_5 is exact."""
    e, g, x0, slope, tolerance = 0.05, 80.0, np.zeros(3), np.array([1.0, 0.0, 0.0]), 1e-6

    def chain(t, x):
        return np.array([1.0, e * x[0], g * x[1]])

    taking = stepper(chain, x0, tolerance)
    first = taking.attempt(0.0, x0, slope, 1e-3, 1e-3)
    done = taking.finish(first, first.x_new)
    taking.advance(done)
    t = 1e-3 + 1e-2  # so much longer than the step before that nothing is predicted
    end = taking.attempt(1e-3, done.x_new, done.slope_new, 1e-2, t).x_new
    np.testing.assert_allclose(end, [t, e * t**2 / 2, g * e * t**3 / 6], rtol=0.0, atol=0.1 * tolerance)
