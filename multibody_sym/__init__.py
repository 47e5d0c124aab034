"""Equations of motion of multibody systems: `import multibody_sym as mbs`; names are imported on first use."""

TYPE_CHECKING = False  # as in typing, without importing it
if TYPE_CHECKING:
    from multibody_sym.analysis.derivations import derive as derive
    from multibody_sym.analysis.equilibrium import Equilibrium as Equilibrium
    from multibody_sym.analysis.equilibrium import equilibrium as equilibrium
    from multibody_sym.analysis.linearization import Linearization as Linearization
    from multibody_sym.analysis.linearization import linearize as linearize
    from multibody_sym.analysis.linearization import period_multipliers as period_multipliers
    from multibody_sym.analysis.periodic import Multipliers as Multipliers
    from multibody_sym.analysis.theorems.conserved import Conserved as Conserved
    from multibody_sym.analysis.theorems.conserved import conserved_quantities as conserved_quantities
    from multibody_sym.analysis.theorems.symbolic import theorems as theorems
    from multibody_sym.answers.drawn import draw as draw
    from multibody_sym.answers.least_for_motion import LeastForMotion as LeastForMotion
    from multibody_sym.answers.least_for_motion import least_for_motion as least_for_motion
    from multibody_sym.answers.range_of_rest import RangeOfRest as RangeOfRest
    from multibody_sym.answers.range_of_rest import range_of_rest as range_of_rest
    from multibody_sym.answers.small_motions.modes import modes as modes
    from multibody_sym.answers.small_motions.record import Modes as Modes
    from multibody_sym.answers.solution import Solution as Solution
    from multibody_sym.answers.solve import solve as solve
    from multibody_sym.checking.check import CheckReport as CheckReport
    from multibody_sym.checking.check import check as check
    from multibody_sym.cli.version import __version__ as __version__
    from multibody_sym.drawing.figure import Figure as Figure
    from multibody_sym.dynamics.derivation.canonical import CanonicalEquations as CanonicalEquations
    from multibody_sym.dynamics.derivation.canonical import FirstIntegral as FirstIntegral
    from multibody_sym.dynamics.derivation.symbolic_equations import SymbolicEquations as SymbolicEquations
    from multibody_sym.errors import ExpressionError as ExpressionError
    from multibody_sym.errors import InputError as InputError
    from multibody_sym.errors import ModelError as ModelError
    from multibody_sym.errors import MultibodyError as MultibodyError
    from multibody_sym.errors import NoSolutionError as NoSolutionError
    from multibody_sym.errors import OutputError as OutputError
    from multibody_sym.errors import RunError as RunError
    from multibody_sym.formats.reader import load as load
    from multibody_sym.formats.reader import loads as loads
    from multibody_sym.formats.reference.json_schema import schema as schema
    from multibody_sym.formats.urdf import UrdfNotice as UrdfNotice
    from multibody_sym.formats.urdf import load_urdf as load_urdf
    from multibody_sym.formats.writer import dump as dump
    from multibody_sym.formats.writer import dumps as dumps
    from multibody_sym.model.declaration.bodies import Body as Body
    from multibody_sym.model.declaration.bodies import Frame as Frame
    from multibody_sym.model.declaration.bodies import GroundMotion as GroundMotion
    from multibody_sym.model.declaration.bodies import Shape as Shape
    from multibody_sym.model.declaration.bodies import Turn as Turn
    from multibody_sym.model.declaration.bodies import VariableMass as VariableMass
    from multibody_sym.model.declaration.constraints import Coupler as Coupler
    from multibody_sym.model.declaration.constraints import Distance as Distance
    from multibody_sym.model.declaration.constraints import Expression as Expression
    from multibody_sym.model.declaration.constraints import Gear as Gear
    from multibody_sym.model.declaration.constraints import Line as Line
    from multibody_sym.model.declaration.constraints import OnCurve as OnCurve
    from multibody_sym.model.declaration.constraints import Plane as Plane
    from multibody_sym.model.declaration.constraints import PointInPlane as PointInPlane
    from multibody_sym.model.declaration.constraints import PointOnLine as PointOnLine
    from multibody_sym.model.declaration.constraints import PrescribedMotion as PrescribedMotion
    from multibody_sym.model.declaration.constraints import Pulley as Pulley
    from multibody_sym.model.declaration.constraints import Rolling as Rolling
    from multibody_sym.model.declaration.constraints import Rope as Rope
    from multibody_sym.model.declaration.constraints import VelocityConstraint as VelocityConstraint
    from multibody_sym.model.declaration.contacts import Contact as Contact
    from multibody_sym.model.declaration.curves.curve import Curve as Curve
    from multibody_sym.model.declaration.forces import Coulomb as Coulomb
    from multibody_sym.model.declaration.forces import Damper as Damper
    from multibody_sym.model.declaration.forces import Drag as Drag
    from multibody_sym.model.declaration.forces import Force as Force
    from multibody_sym.model.declaration.forces import Friction as Friction
    from multibody_sym.model.declaration.forces import Gravitation as Gravitation
    from multibody_sym.model.declaration.forces import Motor as Motor
    from multibody_sym.model.declaration.forces import Potential as Potential
    from multibody_sym.model.declaration.forces import Pull as Pull
    from multibody_sym.model.declaration.forces import SpringDamper as SpringDamper
    from multibody_sym.model.declaration.forces import Torque as Torque
    from multibody_sym.model.declaration.impacts import Impact as Impact
    from multibody_sym.model.declaration.joint import Initial as Initial
    from multibody_sym.model.declaration.joint import Limits as Limits
    from multibody_sym.model.declaration.joints import CurveJoint as CurveJoint
    from multibody_sym.model.declaration.joints import Custom as Custom
    from multibody_sym.model.declaration.joints import Cylindrical as Cylindrical
    from multibody_sym.model.declaration.joints import Direct as Direct
    from multibody_sym.model.declaration.joints import Fixed as Fixed
    from multibody_sym.model.declaration.joints import Free as Free
    from multibody_sym.model.declaration.joints import Planar as Planar
    from multibody_sym.model.declaration.joints import PointJoint as PointJoint
    from multibody_sym.model.declaration.joints import Prismatic as Prismatic
    from multibody_sym.model.declaration.joints import Revolute as Revolute
    from multibody_sym.model.declaration.joints import Screw as Screw
    from multibody_sym.model.declaration.joints import Spherical as Spherical
    from multibody_sym.model.declaration.joints import Universal as Universal
    from multibody_sym.model.declaration.parameters import Parameter as Parameter
    from multibody_sym.model.declaration.settings import Ask as Ask
    from multibody_sym.model.declaration.settings import Baumgarte as Baumgarte
    from multibody_sym.model.declaration.settings import Settings as Settings
    from multibody_sym.model.declaration.settings import SmoothFriction as SmoothFriction
    from multibody_sym.model.declaration.settings import Stabilisation as Stabilisation
    from multibody_sym.model.declaration.surfaces import Surface as Surface
    from multibody_sym.model.declaration.system import System as System
    from multibody_sym.model.declaration.system import parameters as parameters
    from multibody_sym.model.declaration.system import t as t
    from multibody_sym.model.declaration.system import variable as variable
    from multibody_sym.model.declaration.tables import Table as Table
    from multibody_sym.model.resolution.resolve import mechanism as mechanism
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
    from multibody_sym.simulation.canonical.function import canonical_equations as canonical_equations
    from multibody_sym.simulation.export import export as export
    from multibody_sym.simulation.impact_function import impact as impact
    from multibody_sym.simulation.plot import plot as plot
    from multibody_sym.simulation.right_side import compile as compile
    from multibody_sym.simulation.right_side import state_derivative as state_derivative
    from multibody_sym.simulation.simulate import Prepared as Prepared
    from multibody_sym.simulation.simulate import prepare as prepare
    from multibody_sym.simulation.simulate import simulate as simulate
    from multibody_sym.simulation.trajectory import Trajectory as Trajectory
    from multibody_sym.simulation.tree_functions import hybrid_dynamics as hybrid_dynamics
    from multibody_sym.simulation.tree_functions import inverse_dynamics as inverse_dynamics
    from multibody_sym.simulation.tree_functions import mass_matrix as mass_matrix
    from multibody_sym.studies.run import sweep as sweep
    from multibody_sym.studies.study import Study as Study
    from multibody_sym.writing.animation.animate import Animation as Animation
    from multibody_sym.writing.animation.animate import animate as animate
    from multibody_sym.writing.report.report import Report as Report
    from multibody_sym.writing.report.report import report as report

_NAMES = {
    "analysis.derivations": "derive",
    "analysis.equilibrium": "Equilibrium equilibrium",
    "analysis.linearization": "Linearization linearize period_multipliers",
    "analysis.periodic": "Multipliers",
    "analysis.theorems.conserved": "Conserved conserved_quantities",
    "analysis.theorems.symbolic": "theorems",
    "answers.drawn": "draw",
    "answers.least_for_motion": "LeastForMotion least_for_motion",
    "answers.range_of_rest": "RangeOfRest range_of_rest",
    "answers.small_motions.modes": "modes",
    "answers.small_motions.record": "Modes",
    "answers.solution": "Solution",
    "answers.solve": "solve",
    "checking.check": "CheckReport check",
    "cli.version": "__version__",
    "drawing.figure": "Figure",
    "dynamics.derivation.canonical": "CanonicalEquations FirstIntegral",
    "dynamics.derivation.symbolic_equations": "SymbolicEquations",
    "errors": "ExpressionError InputError ModelError MultibodyError NoSolutionError OutputError RunError",
    "formats.reader": "load loads",
    "formats.reference.json_schema": "schema",
    "formats.urdf": "UrdfNotice load_urdf",
    "formats.writer": "dump dumps",
    "model.declaration.bodies": "Body Frame GroundMotion Shape Turn VariableMass",
    "model.declaration.constraints": "Coupler Distance Expression Gear Line OnCurve Plane PointInPlane "
    "PointOnLine PrescribedMotion Pulley Rolling Rope VelocityConstraint",
    "model.declaration.contacts": "Contact",
    "model.declaration.curves.curve": "Curve",
    "model.declaration.forces": "Coulomb Damper Drag Force Friction Gravitation Motor Potential Pull "
    "SpringDamper Torque",
    "model.declaration.impacts": "Impact",
    "model.declaration.joint": "Initial Limits",
    "model.declaration.joints": "CurveJoint Custom Cylindrical Direct Fixed Free Planar PointJoint Prismatic Revolute "
    "Screw Spherical Universal",
    "model.declaration.parameters": "Parameter",
    "model.declaration.settings": "Ask Baumgarte Settings SmoothFriction Stabilisation",
    "model.declaration.surfaces": "Surface",
    "model.declaration.system": "System parameters t variable",
    "model.declaration.tables": "Table",
    "model.resolution.resolve": "mechanism",
    "scalars.functions": "absolute acos asin atan atan2 cos exp log maximum minimum pi sign sin sqrt tan where",
    "simulation.canonical.function": "canonical_equations",
    "simulation.export": "export",
    "simulation.impact_function": "impact",
    "simulation.plot": "plot",
    "simulation.right_side": "compile state_derivative",
    "simulation.simulate": "Prepared prepare simulate",
    "simulation.trajectory": "Trajectory",
    "simulation.tree_functions": "hybrid_dynamics inverse_dynamics mass_matrix",
    "studies.run": "sweep",
    "studies.study": "Study",
    "writing.animation.animate": "Animation animate",
    "writing.report.report": "Report report",
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
            value = import_module(f"{__name__}.model.declaration.doors").door(value)
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

        import_module(f"{__name__}.writing.notebook").register(formatter.formatters)


_show_in_notebooks()
