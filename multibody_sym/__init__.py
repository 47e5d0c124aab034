"""Equations of motion of multibody systems: `import multibody_sym as mbs`; names are imported on first use.

    errors                         errors, suggestions ("did you mean"), exit codes
    records, stages                frozen records; times of the stages of a run
    scalars                        numbers, expressions, matrices
    text, program, contact_laws    expressions, units and files; compiled calculations; laws of contacts as numbers
    model, algebra                 declarations; exact formulas
    mechanics                      a mechanism, its kinematics, rows and forces; model files
    dynamics                       accelerations, Programs, the start, conserved quantities
    derivation, pictures           closed-form equations; figures
    motion, analysis, answers      runs; equilibria, modes, linearisation; solve and `ask`
    documents                      results as text, LaTeX, HTML, films
    cli, __main__                  the command line; the same by `python -m multibody_sym`
"""

TYPE_CHECKING = False  # as in typing, without importing it
if TYPE_CHECKING:
    from multibody_sym.analysis.check import CheckReport as CheckReport
    from multibody_sym.analysis.check import check as check
    from multibody_sym.analysis.equilibrium import Equilibrium as Equilibrium
    from multibody_sym.analysis.equilibrium import Trim as Trim
    from multibody_sym.analysis.equilibrium import equilibrium as equilibrium
    from multibody_sym.analysis.equilibrium import trim as trim
    from multibody_sym.analysis.linearize import FrequencyResponse as FrequencyResponse
    from multibody_sym.analysis.linearize import Linearization as Linearization
    from multibody_sym.analysis.linearize import Multipliers as Multipliers
    from multibody_sym.analysis.linearize import bode as bode
    from multibody_sym.analysis.linearize import linearize as linearize
    from multibody_sym.analysis.linearize import period_multipliers as period_multipliers
    from multibody_sym.analysis.modes.modes import modes as modes
    from multibody_sym.analysis.modes.record import Modes as Modes
    from multibody_sym.analysis.rest.range_of_rest import LeastForMotion as LeastForMotion
    from multibody_sym.analysis.rest.range_of_rest import RangeOfRest as RangeOfRest
    from multibody_sym.analysis.rest.range_of_rest import least_for_motion as least_for_motion
    from multibody_sym.analysis.rest.range_of_rest import range_of_rest as range_of_rest
    from multibody_sym.analysis.robots import BaseParameters as BaseParameters
    from multibody_sym.analysis.robots import Posture as Posture
    from multibody_sym.analysis.robots import base_parameters as base_parameters
    from multibody_sym.analysis.robots import inverse_kinematics as inverse_kinematics
    from multibody_sym.answers.records import Solution as Solution
    from multibody_sym.answers.solve import solve as solve
    from multibody_sym.cli.version import __version__ as __version__
    from multibody_sym.derivation.derive import derive as derive
    from multibody_sym.derivation.symbolic_equations import CanonicalEquations as CanonicalEquations
    from multibody_sym.derivation.symbolic_equations import FirstIntegral as FirstIntegral
    from multibody_sym.derivation.symbolic_equations import SymbolicEquations as SymbolicEquations
    from multibody_sym.derivation.theorems import theorems as theorems
    from multibody_sym.documents.animation.animate import Animation as Animation
    from multibody_sym.documents.animation.animate import animate as animate
    from multibody_sym.documents.animation.live import LivePage as LivePage
    from multibody_sym.documents.animation.live import live as live
    from multibody_sym.documents.draw import draw as draw
    from multibody_sym.documents.report import Report as Report
    from multibody_sym.documents.report import report as report
    from multibody_sym.dynamics.conserved import Conserved as Conserved
    from multibody_sym.dynamics.conserved import conserved_quantities as conserved_quantities
    from multibody_sym.errors import ArgumentError as ArgumentError
    from multibody_sym.errors import ExpressionError as ExpressionError
    from multibody_sym.errors import InputError as InputError
    from multibody_sym.errors import ModelError as ModelError
    from multibody_sym.errors import MultibodyError as MultibodyError
    from multibody_sym.errors import NoSolutionError as NoSolutionError
    from multibody_sym.errors import OutputError as OutputError
    from multibody_sym.errors import RunError as RunError
    from multibody_sym.errors import UndefinedValueError as UndefinedValueError
    from multibody_sym.mechanics.model_files import dump as dump
    from multibody_sym.mechanics.model_files import dumps as dumps
    from multibody_sym.mechanics.model_files import load as load
    from multibody_sym.mechanics.model_files import loads as loads
    from multibody_sym.mechanics.resolve import mechanism as mechanism
    from multibody_sym.model.bodies import Body as Body
    from multibody_sym.model.bodies import Frame as Frame
    from multibody_sym.model.bodies import GroundMotion as GroundMotion
    from multibody_sym.model.bodies import Shape as Shape
    from multibody_sym.model.bodies import Surface as Surface
    from multibody_sym.model.bodies import Turn as Turn
    from multibody_sym.model.bodies import VariableMass as VariableMass
    from multibody_sym.model.constraints import Coupler as Coupler
    from multibody_sym.model.constraints import Distance as Distance
    from multibody_sym.model.constraints import Expression as Expression
    from multibody_sym.model.constraints import Gear as Gear
    from multibody_sym.model.constraints import Line as Line
    from multibody_sym.model.constraints import OnCurve as OnCurve
    from multibody_sym.model.constraints import Plane as Plane
    from multibody_sym.model.constraints import PointInPlane as PointInPlane
    from multibody_sym.model.constraints import PointOnLine as PointOnLine
    from multibody_sym.model.constraints import PrescribedMotion as PrescribedMotion
    from multibody_sym.model.constraints import Pulley as Pulley
    from multibody_sym.model.constraints import Rolling as Rolling
    from multibody_sym.model.constraints import Rope as Rope
    from multibody_sym.model.constraints import VelocityConstraint as VelocityConstraint
    from multibody_sym.model.contacts_and_impacts import Contact as Contact
    from multibody_sym.model.contacts_and_impacts import Impact as Impact
    from multibody_sym.model.forces import Coulomb as Coulomb
    from multibody_sym.model.forces import Damper as Damper
    from multibody_sym.model.forces import Distributed as Distributed
    from multibody_sym.model.forces import Drag as Drag
    from multibody_sym.model.forces import Force as Force
    from multibody_sym.model.forces import Friction as Friction
    from multibody_sym.model.forces import Gravitation as Gravitation
    from multibody_sym.model.forces import Motor as Motor
    from multibody_sym.model.forces import Potential as Potential
    from multibody_sym.model.forces import Pull as Pull
    from multibody_sym.model.forces import SpringDamper as SpringDamper
    from multibody_sym.model.forces import Torque as Torque
    from multibody_sym.model.joints import CurveJoint as CurveJoint
    from multibody_sym.model.joints import Custom as Custom
    from multibody_sym.model.joints import Cylindrical as Cylindrical
    from multibody_sym.model.joints import Direct as Direct
    from multibody_sym.model.joints import Fixed as Fixed
    from multibody_sym.model.joints import Free as Free
    from multibody_sym.model.joints import Initial as Initial
    from multibody_sym.model.joints import Limits as Limits
    from multibody_sym.model.joints import Planar as Planar
    from multibody_sym.model.joints import PointJoint as PointJoint
    from multibody_sym.model.joints import Prismatic as Prismatic
    from multibody_sym.model.joints import Revolute as Revolute
    from multibody_sym.model.joints import Screw as Screw
    from multibody_sym.model.joints import Spherical as Spherical
    from multibody_sym.model.joints import Universal as Universal
    from multibody_sym.model.parameters import Grid as Grid
    from multibody_sym.model.parameters import Parameter as Parameter
    from multibody_sym.model.parameters import StateVariable as StateVariable
    from multibody_sym.model.parameters import Table as Table
    from multibody_sym.model.schema import schema as schema
    from multibody_sym.model.settings import Ask as Ask
    from multibody_sym.model.settings import Baumgarte as Baumgarte
    from multibody_sym.model.settings import Settings as Settings
    from multibody_sym.model.settings import SmoothFriction as SmoothFriction
    from multibody_sym.model.settings import Stabilisation as Stabilisation
    from multibody_sym.model.state_words import Stage as Stage
    from multibody_sym.model.steps import Curve as Curve
    from multibody_sym.model.system import System as System
    from multibody_sym.model.system import parameters as parameters
    from multibody_sym.model.system import t as t
    from multibody_sym.model.system import variable as variable
    from multibody_sym.model.urdf import UrdfNotice as UrdfNotice
    from multibody_sym.model.urdf import load_urdf as load_urdf
    from multibody_sym.motion.function import Function as Function
    from multibody_sym.motion.function import function as function
    from multibody_sym.motion.function import functions as functions
    from multibody_sym.motion.function_values import CanonicalRates as CanonicalRates
    from multibody_sym.motion.function_values import CentroidalMomentum as CentroidalMomentum
    from multibody_sym.motion.function_values import ConstraintTerms as ConstraintTerms
    from multibody_sym.motion.function_values import EnergyResults as EnergyResults
    from multibody_sym.motion.function_values import FrameJacobian as FrameJacobian
    from multibody_sym.motion.function_values import FrameMotion as FrameMotion
    from multibody_sym.motion.function_values import HybridForces as HybridForces
    from multibody_sym.motion.function_values import ImpactResults as ImpactResults
    from multibody_sym.motion.function_values import MomentumResults as MomentumResults
    from multibody_sym.motion.function_values import OperationalSpace as OperationalSpace
    from multibody_sym.motion.function_values import OrdinaryEquations as OrdinaryEquations
    from multibody_sym.motion.function_values import Rates as Rates
    from multibody_sym.motion.function_values import Regressor as Regressor
    from multibody_sym.motion.prepare.export import export as export
    from multibody_sym.motion.prepare.functions import canonical_equations as canonical_equations
    from multibody_sym.motion.prepare.functions import compile as compile
    from multibody_sym.motion.prepare.functions import hybrid_dynamics as hybrid_dynamics
    from multibody_sym.motion.prepare.functions import impact as impact
    from multibody_sym.motion.prepare.functions import inverse_dynamics as inverse_dynamics
    from multibody_sym.motion.prepare.functions import mass_matrix as mass_matrix
    from multibody_sym.motion.prepare.functions import state_derivative as state_derivative
    from multibody_sym.motion.results.plot import plot as plot
    from multibody_sym.motion.results.samples import Samples as Samples
    from multibody_sym.motion.results.trajectory import Trajectory as Trajectory
    from multibody_sym.motion.runs.run import FailedRunError as FailedRunError
    from multibody_sym.motion.runs.run import MotionEndsError as MotionEndsError
    from multibody_sym.motion.simulate import Prepared as Prepared
    from multibody_sym.motion.simulate import prepare as prepare
    from multibody_sym.motion.simulate import simulate as simulate
    from multibody_sym.motion.stepper import Stepper as Stepper
    from multibody_sym.motion.stepper import StepperState as StepperState
    from multibody_sym.motion.sweep.study import Study as Study
    from multibody_sym.motion.sweep.study import StudyNotice as StudyNotice
    from multibody_sym.motion.sweep.study import sweep as sweep
    from multibody_sym.pictures.draw import Figure as Figure
    from multibody_sym.program.program import OperationCount as OperationCount
    from multibody_sym.scalars.functions import absolute as absolute
    from multibody_sym.scalars.functions import acos as acos
    from multibody_sym.scalars.functions import asin as asin
    from multibody_sym.scalars.functions import atan as atan
    from multibody_sym.scalars.functions import atan2 as atan2
    from multibody_sym.scalars.functions import cos as cos
    from multibody_sym.scalars.functions import exp as exp
    from multibody_sym.scalars.functions import log as log
    from multibody_sym.scalars.functions import maximum as maximum
    from multibody_sym.scalars.functions import minimum as minimum
    from multibody_sym.scalars.functions import pi as pi
    from multibody_sym.scalars.functions import sign as sign
    from multibody_sym.scalars.functions import sin as sin
    from multibody_sym.scalars.functions import sqrt as sqrt
    from multibody_sym.scalars.functions import tan as tan
    from multibody_sym.scalars.functions import where as where

_NAMES = {
    "analysis.check": "CheckReport check",
    "analysis.equilibrium": "Equilibrium equilibrium Trim trim",
    "analysis.linearize": "FrequencyResponse Linearization Multipliers linearize period_multipliers bode",
    "analysis.modes.modes": "modes",
    "analysis.modes.record": "Modes",
    "analysis.rest.range_of_rest": "LeastForMotion RangeOfRest least_for_motion range_of_rest",
    "analysis.robots": "BaseParameters Posture base_parameters inverse_kinematics",
    "answers.records": "Solution",
    "answers.solve": "solve",
    "cli.version": "__version__",
    "derivation.derive": "derive",
    "derivation.symbolic_equations": "CanonicalEquations FirstIntegral SymbolicEquations",
    "derivation.theorems": "theorems",
    "documents.animation.animate": "Animation animate",
    "documents.animation.live": "LivePage live",
    "documents.draw": "draw",
    "documents.report": "Report report",
    "dynamics.conserved": "Conserved conserved_quantities",
    "errors": "ArgumentError ExpressionError InputError ModelError MultibodyError NoSolutionError OutputError RunError "
    "UndefinedValueError",
    "mechanics.model_files": "dump dumps load loads",
    "mechanics.resolve": "mechanism",
    "model.bodies": "Body Frame GroundMotion Shape Surface Turn VariableMass",
    "model.constraints": "Coupler Distance Expression Gear Line OnCurve Plane PointInPlane PointOnLine "
    "PrescribedMotion Pulley Rolling Rope VelocityConstraint",
    "model.contacts_and_impacts": "Contact Impact",
    "model.forces": "Coulomb Damper Distributed Drag Force Friction Gravitation Motor Potential Pull SpringDamper "
    "Torque",
    "model.joints": "CurveJoint Custom Cylindrical Direct Fixed Free Initial Limits Planar PointJoint Prismatic "
    "Revolute Screw Spherical Universal",
    "model.parameters": "Grid Parameter StateVariable Table",
    "model.schema": "schema",
    "model.settings": "Ask Baumgarte Settings SmoothFriction Stabilisation",
    "model.state_words": "Stage",
    "model.steps": "Curve",
    "model.system": "System parameters t variable",
    "model.urdf": "UrdfNotice load_urdf",
    "motion.function": "Function function functions",
    "motion.function_values": "CanonicalRates CentroidalMomentum ConstraintTerms EnergyResults FrameJacobian "
    "FrameMotion HybridForces ImpactResults MomentumResults OperationalSpace OrdinaryEquations Rates Regressor",
    "motion.prepare.export": "export",
    "motion.prepare.functions": "canonical_equations compile hybrid_dynamics impact inverse_dynamics mass_matrix "
    "state_derivative",
    "motion.results.plot": "plot",
    "motion.results.samples": "Samples",
    "motion.results.trajectory": "Trajectory",
    "motion.runs.run": "FailedRunError MotionEndsError",
    "motion.simulate": "Prepared prepare simulate",
    "motion.stepper": "Stepper StepperState",
    "motion.sweep.study": "Study StudyNotice sweep",
    "pictures.draw": "Figure",
    "program.program": "OperationCount",
    "scalars.functions": "absolute acos asin atan atan2 cos exp log maximum minimum pi sign sin sqrt tan where",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_MODULES)  # noqa: PLE0605


if not TYPE_CHECKING:  # type checkers see the names above, and none that is not there

    def __getattr__(name: str) -> object:
        """Import a public name when it is first asked for."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from importlib import import_module

        value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
        if type(value) is type(__getattr__):  # a function: wrong arguments are told, and pickles find it here
            value = import_module(f"{__name__}.model.argument_checks").door(value)
            value.__module__ = __name__
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the names there are, imported yet or not."""
    return sorted({*globals(), *_MODULES})


def _show_in_notebooks() -> None:
    """Let notebooks show results as figures, formulas and tables, where IPython runs."""
    import sys

    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    formatter = getattr(shell, "display_formatter", None)
    if formatter is not None:
        from importlib import import_module

        import_module(f"{__name__}.documents.notebook").register(formatter.formatters)


_show_in_notebooks()
