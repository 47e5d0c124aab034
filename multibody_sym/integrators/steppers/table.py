"""The stepper of each family of methods."""

from __future__ import annotations

from functools import singledispatch

from multibody_sym.integrators.flow import Flow, Stepper
from multibody_sym.integrators.methods.collocation import Collocation
from multibody_sym.integrators.methods.methods import Method
from multibody_sym.integrators.methods.multistep import AdamsBashforthMoulton, Stoermer, StoermerVerlet
from multibody_sym.integrators.methods.runge_kutta import RungeKutta
from multibody_sym.integrators.steppers.collocation import CollocationStepper
from multibody_sym.integrators.steppers.explicit import ExplicitStepper
from multibody_sym.integrators.steppers.multistep import AdamsStepper, StoermerStepper, VerletStepper


@singledispatch
def stepper(method: Method, flow: Flow) -> Stepper:
    """Return what takes the steps of a method; raises TypeError for a family that is not known."""
    raise TypeError(f"{method!r} is no method")


@stepper.register
def _explicit(method: RungeKutta, flow: Flow) -> Stepper:
    return ExplicitStepper(method.tableau, flow)


@stepper.register
def _adams(method: AdamsBashforthMoulton, flow: Flow) -> Stepper:
    return AdamsStepper(method, flow)


@stepper.register
def _stoermer(method: Stoermer, flow: Flow) -> Stepper:
    return StoermerStepper(method, flow)


@stepper.register
def _verlet(method: StoermerVerlet, flow: Flow) -> Stepper:
    return VerletStepper(method, flow)


@stepper.register
def _collocation(method: Collocation, flow: Flow) -> Stepper:
    return CollocationStepper(method.scheme, flow)
