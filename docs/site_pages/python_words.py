"""The groups of the Python reference, and the meaning of each parameter of a public function."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple


class Group(NamedTuple):
    """A page of the Python reference: its title, its first paragraph, and the names on it."""

    title: str
    about: str
    names: tuple[str, ...]


GROUPS: Final[Mapping[str, Group]] = {
    "models": Group(
        "Models and files", "Declare a system in Python, read it from a file, or write it to one.",
        tuple("""
        load loads load_urdf dump dumps schema parameters variable mechanism System Body Parameter Frame
        Turn Surface Shape Curve Table Grid StateVariable VariableMass Stage Ask Settings Stabilisation
        Baumgarte Initial Limits Samples UrdfNotice
        """.split()),
    ),
    "joints": Group(
        "Joints and constraints", "Joints carry bodies; constraints, gears, ropes and rolling restrict their motion.",
        tuple("""
        Revolute Prismatic Cylindrical Universal Spherical Planar Free Fixed Screw Custom PointJoint
        CurveJoint Direct GroundMotion PrescribedMotion Distance PointInPlane PointOnLine Plane Line
        OnCurve Coupler Gear Rolling Rope Pulley Expression VelocityConstraint
        """.split()),
    ),
    "forces": Group(
        "Forces, contacts and impacts", "Forces act on bodies and in joints; contacts and impacts act between bodies.",
        tuple("""
        Force Distributed Torque SpringDamper Damper Drag Potential Gravitation Coulomb Pull Motor Friction
        SmoothFriction Contact Impact
        """.split()),
    ),
    "questions": Group(
        "Questions and their answers", "Each function takes a System and returns a result with named fields.",
        tuple("""
        solve derive check equilibrium range_of_rest least_for_motion modes conserved_quantities
        theorems inverse_kinematics base_parameters Solution SymbolicEquations CanonicalEquations CheckReport
        Equilibrium RangeOfRest LeastForMotion Modes Conserved FirstIntegral Posture BaseParameters
        """.split()),
    ),
    "motion": Group(
        "Motion and pictures", "Run a system once or many times; draw, plot, animate and report the results.",
        tuple("""
        simulate prepare sweep draw plot animate live report Trajectory Prepared Stepper StepperState Study
        StudyNotice Figure Animation LivePage Report
        """.split()),
    ),
    "functions": Group(
        "Functions, derivatives and code", "Evaluate the equations at any state, differentiate them, and export them.",
        tuple("""
        function functions Function compile state_derivative mass_matrix inverse_dynamics
        hybrid_dynamics impact canonical_equations export Rates CanonicalRates HybridForces EnergyResults
        MomentumResults CentroidalMomentum ConstraintTerms FrameMotion FrameJacobian OperationalSpace Regressor
        ImpactResults OrdinaryEquations OperationCount
        """.split()),
    ),
    "control": Group(
        "Control", "Linear models, frequency responses, inputs that hold a state, stability of periodic motions.",
        tuple("linearize bode trim period_multipliers Linearization FrequencyResponse Trim Multipliers".split()),
    ),
    "expressions": Group(
        "Expressions", "Numbers with names: operators `+ - * / **` and these functions combine them.",
        tuple("""
        t pi sin cos tan asin acos atan atan2 exp log sqrt absolute sign minimum maximum where __version__
        """.split()),
    ),
    "errors": Group(
        "Errors",
        "All errors have `message`, `number` and `where`; each [number](../errors.md) has a cause and a cure.",
        tuple("""
        MultibodyError InputError ArgumentError ModelError ExpressionError UndefinedValueError
        NoSolutionError RunError FailedRunError MotionEndsError OutputError
        """.split()),
    ),
}  # fmt: skip

PARAMETERS: Final[Mapping[str, str]] = {
    "a": "a number or an expression",
    "asked": "by name, `what` of each function, with its options",
    "at": 'the state: values by name, or "equilibrium"; None for the start',
    "atol": "absolute tolerance of an adaptive method",
    "axes": 'the axes in which vectors are returned, "world" or "local"',
    "b": "the other number or expression",
    "backend": '"c" or "python"; None: C where a compiler is found',
    "budget": "the seconds that the derivation may take; None for 60",
    "command": "the command line that the report prints",
    "condition": "a comparison of expressions, such as `t < 1`",
    "constraints": 'how constraints are kept: "projection", "baumgarte" or "index_2"',
    "coordinates": '"relative" (of joints) or "absolute" (of bodies)',
    "damping": "read the damping of the joints",
    "diagrams": "draw N, V, M of beams and plans of velocities below",
    "phase": "the coordinate whose phase portrait, or body whose polhodes are drawn instead",
    "digits": "how many digits numbers have",
    "dimensions": "draw named lengths",
    "directory": "the folder to write to; of an FMU the file",
    "drives": "joints whose motion is given in place of their forces",
    "executor": "an executor of concurrent.futures, in place of threads",
    "exercise": "whether a report has the figure, the givens and the question alone",
    "file": "the path to write to",
    "floating": "the root link moves freely; otherwise it is fixed to ground",
    "fold": "write the values of the parameters into the code",
    "fmi": "the version of an FMU, 2 or 3",
    "forces": "draw weights, springs and drags",
    "formalism": "the formalism by name; None for the cheapest",
    "fragment": "whether LaTeX is a fragment for `\\input`, with labels",
    "frame": "a body, point or frame, such as `arm.tip`",
    "friction": "read the friction of the joints",
    "functions": "further functions in the code: names such as `mass_matrix`, or Functions by names",
    "given": "joints or names whose accelerations are given",
    "initial": "other start values by name; `~` is solved for",
    "inputs": "other inputs by name: a number, an expression or a function",
    "key": "a text that names what `reduce` computes",
    "least": "the parameter, a force, whose least value is found",
    "limits": "respect the limits of the joints",
    "mark": "places of the model to mark, such as `joints.A`",
    "method": "the method by name; None for the default",
    "mimic": "read joints that follow others",
    "mode": 'the states of contacts and friction by name; "found" as at the start',
    "model": "the system",
    "moving": "accept a state in which A changes with time",
    "name": "the name",
    "names": "the names, separated by spaces; of figures `letters`, `all` or `none`",
    "native": "compile for this processor only",
    "numbers": "a seed from which other round numbers of the parameters follow",
    "omega": "angular frequencies in rad/s",
    "on_progress": "a function that is called as the work goes on",
    "output": "the table to write: .csv, .npz or .parquet",
    "outputs": "names of outputs; all by default",
    "parameters": "other values of parameters by name",
    "path": "the path of the file",
    "period": "the period in s, a number or an expression",
    "position": "where the frame's origin shall be, in m (3,)",
    "positive": "the parameters are positive",
    "project": "let start values change as constraints need",
    "reactions": "draw forces of joints, contacts, ropes and rods",
    "reduce": "a function from a Trajectory to a map of numbers",
    "redundant": "mark joints with redundant constraints",
    "rotation": "how the frame shall be turned (3, 3); None for any way",
    "rows": "the values of each run, in place of `vary`",
    "rtol": "relative tolerance of an adaptive method",
    "run": "the motion",
    "runs": "a motion, a list of motions, or motions by name",
    "sample": "how many runs are drawn from the ranges",
    "samples": "the number of rows, or their times in s",
    "seed": "the seed of the draw",
    "show": "names that are shown; None for all",
    "sobol": "draw evenly, from Sobol's sequence",
    "speed": "how fast the film plays; 1 is real time",
    "step": "the fixed step in s",
    "steps": "also return the solution step by step",
    "strip": "the beginning of names that labels leave out, such as `panda_`",
    "system": "the system",
    "t_end": "the end of the run in s",
    "text": "the text of a model file",
    "to": 'the language: "c", "python" and others',
    "torques": "give each joint with one coordinate a torque as input",
    "trace": "bodies and points whose paths are shown",
    "units": "units of the results, such as `mm,deg`",
    "unknown": "inputs that are solved for",
    "values": "their values, one for each name",
    "vary": "what varies: a name, or values or ranges by name",
    "view": '"front", "top", "iso" and others, or two angles in degrees',
    "wanted": "the question that `state_derivative` and others return",
    "what": "the name of the function, or names of outputs",
    "workers": "the number of threads; None for one a processor",
    "x": "the name on the horizontal axis; for `atan2` the divisor",
    "y": "the dividend",
}
