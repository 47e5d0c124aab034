"""Every public callable with one valid call: its parameters, each with a value that is taken."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial, wraps
from importlib import import_module
from pathlib import Path
from typing import Any

import multibody_sym as mbs

MODEL = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: {value: 0.5 m, positive: true}, g: 9.81, T: 1}
bodies: {bob: {mass: m, com: [0, -l, 0], inertia: {Izz: 0.1}}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 30 deg}}}
forces: {drive: {type: torque, joint: hinge, value: F}}
inputs: {F: T*sin(t)}
outputs: {pull: "reaction(hinge, fy)"}
simulation: {t_end: 0.05, samples: 3}
"""
URDF = '<robot name="r"><link name="base"/></robot>'


@dataclass(frozen=True)
class Call:
    """A callable with the parameters of a valid call; `slow` ones take more than a few milliseconds."""

    name: str
    function: Callable[..., Any]
    given: Mapping[str, Any]
    slow: bool = False

    def __call__(self, given: Mapping[str, Any]) -> Any:
        """Call the function, by position where it takes parameters so only."""
        kinds = inspect.signature(self.function).parameters
        by_position = [given[name] for name in given if kinds[name].kind is inspect.Parameter.POSITIONAL_ONLY]
        named = {name: x for name, x in given.items() if kinds[name].kind is not inspect.Parameter.POSITIONAL_ONLY}
        return self.function(*by_position, **named)


def calls(folder: Path) -> list[Call]:
    """Return a call for each public callable, and for what they return where that can be called too."""
    system = mbs.loads(MODEL)
    (folder / "model.yaml").write_text(MODEL, encoding="utf-8")
    (folder / "robot.urdf").write_text(URDF, encoding="utf-8")
    return [*_scalars(), *_elements(), *_doors(system), *_compiled(system), *_results(system)]


def _scalars() -> list[Call]:
    one = {name: Call(name, getattr(mbs, name), {"a": 0.5}) for name in _ONE}
    two = [Call(name, getattr(mbs, name), {"a": 0.5, "b": mbs.t}) for name in ("minimum", "maximum")]
    return [
        *one.values(), *two,
        Call("atan2", mbs.atan2, {"y": 0.5, "x": 1.0}),
        Call("where", mbs.where, {"condition": mbs.t < 1, "a": 0.5, "b": mbs.t}),
        Call("variable", mbs.variable, {"name": "x"}),
        Call("parameters", mbs.parameters, {"names": "a", "values": [1], "positive": True, "units": "kg"}),
    ]


_ONE = "sin cos tan asin acos atan exp log sqrt absolute sign".split()
_JOINT: dict[str, Any] = {"parent": "ground", "child": "b", "cut": False, "label": "A"}
_LETTERS: dict[str, Any] = {"q_label": None, **_JOINT}
_STATE: dict[str, Any] = {"q": ["x"], "motion": [None], "initial": {"q": 1}, "limits": {"upper": 1}, **_LETTERS}
_MOVES: dict[str, Any] = {"q": None, "motion": None, "initial": {"known": True}, "limits": None, **_LETTERS}
_ENDS = {"between": ["a", "b"]}
_ELEMENTS: dict[str, dict[str, Any]] = {
    "Ask": {
        "value": None, "of": None, "after": 0, "when": None, "at": None, "along": None, "max": 1, "min": None,
        "until": 2, "find": None, "so": None, "between": None, "least": None, "greatest": None,
        "limit": None, "let": None, "series": None, "in_": None, "about": None, "through": None, "formula": None,
        "period_of": None, "advance": None,
        "section": None, "component": None, "stage": None,
        "velocity": None, "acceleration": None, "instant_center": None,
        "amplitude": None, "phase": None, "resonance": None, "antiresonance": None, "transmissibility": None,
        "decrement": None, "damping": None, "action": None, "principal_axes": None, "bracket": None, "canonical": None,
    },
    "Baumgarte": {"alpha": 1, "beta": 1},
    "Body": {
        "mass": 1, "com": [0, 0, 0], "inertia": {"Izz": 1}, "shape": None, "points": {"p": [0, 0, 0]},
        "frames": {"f": {}}, "motion": {"x": 1}, "surfaces": {"s": {"sphere": 1}}, "label": "b",
    },
    "Contact": {
        "between": ["a", "b"], "static": 0.2, "kinetic": 0.1, "restitution": 0, "rolling_resistance": 0.01,
        "tangent": "x", "open": True, "repeat": None, "tangential_restitution": 0,
    },
    "Coupler": {"joints": {"A": 1}, "value": 0, "acts": "in_joints"},
    "Curve": {"x": None, "y": "s^2", "z": "s", "parameter": "s", "unit": "m"},
    "CurveJoint": {**_STATE, "curve": {"y": "x^2"}, "turns": "tangent"},
    "Custom": {**_MOVES, "free": [{"rotate": "x"}]},
    "Cylindrical": {**_MOVES, "axis": "x"},
    "Damper": {"damping": 1, **_ENDS, "joint": None, "freedom": None},
    "Direct": {"translate": None, "rotate": "x", "pitch": 1, "curve": None},
    "Distance": {**_ENDS, "value": 1},
    "Distributed": {"on": "b", "between": ["p", "origin"], "value": [0, "-2*s", 0], "frame": "b"},
    "Drag": {"on": "b", "at": "p", "linear": 1, "quadratic": 1},
    "Expression": {"zero": mbs.t, "acts": "in_joints"},
    "Fixed": _JOINT,
    "Force": {"on": "b", "value": [0, 0, 1], "at": "p", "frame": "b"},
    "Friction": {
        "joint": "A", "static": 1, "kinetic": 1, "radius": 1, "length": None, "regularised": None, "force": None,
    },
    "Frame": {"position": [0, 0, 0], "rotate": [{"axis": "x", "angle": 1}]},
    "Free": {**_MOVES, "angles": "xyz"},
    "Grid": {
        "x": [0, 1], "y": [0, 1], "values": [[0, 1], [2, 3]], "of": ["t", "A"], "interpolation": "linear",
        "dimension": "N", "outside": "error",
    },
    "Gear": {"joints": ["A", "B"], "ratio": -2, "value": 0, "acts": None, "radii": [1, 2], "at": None},
    "GroundMotion": {"x": 0, "y": 0, "z": 0, "turn": [{"axis": "x", "angle": 1}]},
    "Impact": {
        "between": ["a", "b"], "normal": "x", "restitution": 1, "static": None, "kinetic": 0.1,
        "tangential_restitution": 0, "contacts": None, "impulse": None, "at": None, "couple": None, "on": None,
        "begins": None, "motion": None, "speed": None, "frame": "b",
    },
    "Initial": {"q": [1], "u": [1], "known": True},
    "Limits": {"lower": 0, "upper": 1, "velocity": 1, "effort": 1, "restitution": 0, "acts": False},
    "Line": {"through": "p", "direction": "x"},
    "Motor": {"joint": "A", "voltage": 1, "resistance": 1, "constant": 1, "gear": 1, "freedom": "x"},
    "OnCurve": {"point": "b", "curve": {"y": "x^2"}, "on": "ground"},
    "Parameter": {"value": 1, "dimension": "kg", "positive": True, "label": "m"},
    "Planar": _MOVES,
    "Plane": {"through": "p", "normal": "x"},
    "PointInPlane": {"point": "p", "plane": {"through": "p", "normal": "x"}},
    "PointOnLine": {"point": "p", "line": {"through": "p", "direction": "x"}},
    "PointJoint": {**_MOVES, "axes": "xy"},
    "PrescribedMotion": {"joint": "A", "value": mbs.t},
    "Prismatic": {**_STATE, "q": ["x"], "q_label": ["x_1"], "motion": None, "axis": "x"},
    "Potential": {
        "value": 1, "between": None, "joint": None, "joints": None, "on": "b", "at": "p", "frame": "b",
    },
    "Gravitation": {**_ENDS, "constant": 1, "masses": [1, 1]},
    "Coulomb": {**_ENDS, "charges": [1, 1], "constant": 1},
    "Pull": {**_ENDS, "value": 1},
    "Pulley": {"at": "p", "radius": 1, "axis": "z", "body": None, "rough": 0.2},
    "Revolute": {**_STATE, "q": None, "initial": None, "axis": "x"},
    "Rolling": {"body": "b.s", "on": "ground.p", "static": 0.2, "kinetic": 0.1},
    "Rope": {
        "path": ["a", "P", "b"], "length": 1, "slack": False, "wind": ["P"], "wrap": {"P": "+"}, "turns": {"P": 1},
        "label": "T", "restitution": 0.5,
    },
    "Screw": {**_STATE, "motion": None, "axis": "x", "pitch": 1},
    "Settings": {
        "t_end": 1, "step": None, "rtol": 1e-6, "atol": 1e-6, "method": "rk4", "samples": 3, "coordinates": "relative",
        "constraints": {"projection": True}, "project": False, "multipliers": "basic", "friction": None,
    },
    "Shape": {"kind": "rod", "sizes": [1], "mass": 1},
    "SmoothFriction": {"regularised": 1e-3},
    "Spherical": {**_MOVES, "angles": "xyz"},
    "SpringDamper": {"stiffness": 1, **_ENDS, "joint": None, "freedom": None, "damping": 1, "length": 1},
    "StateVariable": {"rate": 1, "initial": 0, "dimension": "Pa"},
    "Stabilisation": {"baumgarte": {"alpha": 1}, "projection": None, "index_2": None},
    "Surface": {
        "sphere": 1, "disc": None, "axis": "z", "centre": [0, 0, 0], "plane": None, "normal": "z", "between": None,
        "segment": None, "point": None, "inside": False, "revolution": None,
        "curve": None, "outline": None, "side": None,
    },
    "Stage": {
        "after": 1, "at": None, "when": None, "impact": None, "release": ["c"], "begins": None, "initial": {"u_A": 0},
    },
    "Table": {
        "table": [[0, 0], [1, 1]], "of": "t", "interpolation": "linear", "dimension": "N", "outside": "hold",
    },
    "Torque": {"value": 1, "joint": "A", "freedom": "x", "on": None, "frame": "b", "at": None},
    "Turn": {"axis": "x", "angle": 1},
    "VariableMass": {
        "value": 1, "relative_velocity": [0, 0, 0], "absolute_velocity": None, "frame": "ground", "at": None,
    },
    "Universal": {**_MOVES, "axes": ["x", "y"]},
    "VelocityConstraint": {"zero": mbs.t, "acts": "in_joints"},
}
_PENDULUM: dict[str, Any] = {
    "name": "s", "gravity": [0, -9.81, 0], "parameters": {"m": 1}, "bodies": {"b": {"mass": "m", "com": [1, 0, 0]}},
    "joints": {"A": {"type": "revolute", "parent": "ground", "child": "b"}},
    "forces": {"f": {"type": "force", "on": "b", "value": [0, 0, 1]}},
    "constraints": {"c": {"type": "expression", "zero": "A"}}, "pulleys": {"P": {"at": "b"}}, "contacts": {},
    "impact": None, "then": [], "inputs": {"F": "t"},
    "outputs": {"o": "A"}, "stop": {"s": "A < 0"}, "ask": {"a": "A"}, "simulation": {"t_end": 1},
}


_STUDY: dict[str, Any] = {
    "vary": {"m": [1, 2]}, "rows": None, "sample": 2, "seed": 1, "sobol": False, "reduce": None, "output": None,
    "workers": 1, "executor": None,
}

_FIGURE: dict[str, Any] = {
    "path": "drawn.svg", "at": 0.0, "view": "iso", "forces": True, "reactions": False, "names": "all",
    "dimensions": True, "redundant": False, "mark": ["joints.hinge"], "strip": "panda_",
}


def _elements() -> list[Call]:
    of_runs = ("FailedRunError", "MotionEndsError")
    errors = [name for name in mbs.__all__ if name.endswith("Error") and name not in of_runs]
    raised = {"message": "m", "where": None, "excerpt": "e"}
    return [
        *(Call(name, getattr(mbs, name), _accepted(getattr(mbs, name), given)) for name, given in _ELEMENTS.items()),
        Call("System", mbs.System, _PENDULUM),
        *(Call(name, getattr(mbs, name), raised) for name in errors),
        *(Call(name, getattr(mbs, name), {"message": "m", "trajectory": None}) for name in of_runs),
    ]


def _accepted(cls: type[Any], given: dict[str, Any]) -> dict[str, Any]:
    """Return the given parameters and those that are new since, left as they are by default."""
    known = inspect.signature(cls).parameters
    return {name: value for name, value in given.items() if name in known}


def _doors(system: mbs.System) -> list[Call]:
    """Return the functions that read, write and ask for results."""
    whole, still = {"system": system}, mbs.loads(MODEL.replace("q: 30 deg", "q: 0"))
    period = {"system": still, "period": 0.1}
    run = {
        "t_end": 0.02, "method": "rk4", "step": 0.01, "rtol": None, "atol": None, "samples": 2, "constraints": None,
        "native": False, "backend": "python", "on_progress": None,
    }
    prepared = {name: value for name, value in run.items() if name != "on_progress"}
    changes = {
        "parameters": {"m": 2}, "initial": {"theta": 0.1}, "inputs": {"F": 0}, "coordinates": "relative",
        "project": False, "formalism": None,
    }
    reach = {"frame": "bob", "position": [0, 0, 0], "rotation": None, "initial": {"theta": 0.1}, "limits": True}
    trimmed = {name: changes[name] for name in ("parameters", "initial", "inputs")}
    asked = {"given": (), "frame": None, "axes": "world", "formalism": None, "native": False, "backend": "python"}
    asked |= {"drives": (), "mode": None}
    urdf = {"damping": True, "mimic": True, "torques": False, "friction": False}
    drawn = _without_compiler(mbs.draw, "multibody_sym.motion.simulate")
    exported = {"to": "python", "directory": "out", "fold": False, "fmi": 2, "functions": ["mass_matrix"]}
    return [
        Call("load", mbs.load, {"path": "model.yaml"}),
        Call("loads", mbs.loads, {"text": MODEL, "name": "m"}),
        Call("schema", mbs.schema, {}),
        Call("load_urdf", mbs.load_urdf, {"path": "robot.urdf", "floating": False, **urdf}),
        Call("dump", mbs.dump, {**whole, "file": "dumped.yaml"}),
        Call("dumps", mbs.dumps, whole),
        Call("mechanism", mbs.mechanism, whole),
        Call("derive", mbs.derive, {"model": system, "method": None, "budget": None, **changes}, slow=True),
        Call("theorems", mbs.theorems, {**whole, "method": None, "budget": None, **changes}, slow=True),
        Call("conserved_quantities", mbs.conserved_quantities, {**whole, **changes}, slow=True),
        Call("check", mbs.check, {**whole, **changes}, slow=True),
        Call("solve", mbs.solve, {**whole, **changes}, slow=True),
        Call("modes", mbs.modes, {**whole, "at": {"theta": 0}, "period": None, **changes}, slow=True),
        Call("linearize", mbs.linearize, {**whole, "at": {"theta": 0}, **changes}, slow=True),
        Call("bode", mbs.bode, {**whole, "omega": [1.0], "inputs": "F", "outputs": (), "at": {"theta": 0}}, slow=True),
        Call("trim", mbs.trim, {**whole, "at": {"theta": 0}, "unknown": "F", **trimmed}, slow=True),
        Call("inverse_kinematics", mbs.inverse_kinematics, {**whole, **reach}, slow=True),
        Call("base_parameters", mbs.base_parameters, whole, slow=True),
        Call("period_multipliers", mbs.period_multipliers, {**period, "at": "equilibrium", **changes}, slow=True),
        Call("equilibrium", mbs.equilibrium, {**whole, **changes}, slow=True),
        Call("range_of_rest", mbs.range_of_rest, {**whole, "vary": "m", **changes}, slow=True),
        Call("least_for_motion", mbs.least_for_motion, {**whole, "least": "m", "vary": "l", **changes}, slow=True),
        Call("draw", drawn, {**whole, **_FIGURE, **changes}, slow=True),
        Call("simulate", mbs.simulate, {**whole, **run, **changes}, slow=True),
        Call("sweep", mbs.sweep, {**whole, **_STUDY, **run, **changes}, slow=True),
        Call("prepare", mbs.prepare, {**whole, **prepared, **changes}, slow=True),
        Call("export", mbs.export, {**whole, **exported, **changes}, slow=True),
        Call("state_derivative", mbs.state_derivative, {**whole, "formalism": None}),
        Call("canonical_equations", mbs.canonical_equations, whole),
        Call("mass_matrix", mbs.mass_matrix, whole),
        Call("inverse_dynamics", mbs.inverse_dynamics, whole),
        Call("impact", mbs.impact, {"system": replace(system, impact=mbs.Impact(impulse=[1, 0, 0], at="bob"))}),
        Call("hybrid_dynamics", mbs.hybrid_dynamics, {**whole, "given": ["hinge"]}),
        Call("function", mbs.function, {**whole, "what": "bias", **asked}),
        Call("functions", mbs.functions, {**whole, "asked": {"M": "bias"}, "native": False, "backend": "python"}),
        Call("compile", _compile, {"wanted": mbs.state_derivative(system), "native": False, "backend": "python"}),
    ]


def _without_compiler(door: Callable[..., Any], module: str) -> Callable[..., Any]:
    """Return a function whose runs on the way, which its module simulates, take no compiler, as in the other calls."""

    @wraps(door)
    def called(**given: Any) -> Any:
        place = import_module(module)
        plain = place.simulate
        place.simulate = lambda system, **more: plain(system, **{**more, "native": False, "backend": "python"})
        try:
            return door(**given)
        finally:
            place.simulate = plain

    return called


@wraps(mbs.compile)
def _compile(wanted: Any, native: Any, backend: Any) -> Any:
    return mbs.compile(wanted, native=native, backend=backend)


def _compiled(system: mbs.System) -> list[Call]:
    more = {"parameters": {"m": 2}, "inputs": {"F": 1}}
    rhs = mbs.compile(mbs.state_derivative(system), backend="python")
    canonical = mbs.compile(mbs.canonical_equations(system), backend="python")
    momenta = mbs.derive(system, "hamilton")
    inertia = mbs.compile(mbs.mass_matrix(system), backend="python")
    forces = mbs.compile(mbs.inverse_dynamics(system), backend="python")
    hybrid = mbs.compile(mbs.hybrid_dynamics(system, ["hinge"]), backend="python")
    asked = mbs.function(system, "state_derivative", backend="python")
    prepared = mbs.prepare(system, backend="python", method="rk4", step=0.1)
    sim = prepared.stepper(0.1)
    tree = {"t": 0.0, "q": [0.1], "u": [0.2], "udot": None, **more}
    values = [1, 0.5, 9.81, 1]
    numeric = {"q": [0.1], "u": [0.2], "t": 0.0, "parameters": values}
    equations = mbs.derive(system)
    return [
        Call("compiled state derivative", rhs.__call__, {"t": 0.0, "x": [0.1, 0.2], **more}),
        Call("compiled canonical equations", canonical.__call__, {"t": 0.0, "x": [0.1, 0.2], **more}),
        Call("compiled momenta", canonical.momenta, {"t": 0.0, "q": [0.1], "u": [0.2], **more}),
        Call("compiled speeds", canonical.speeds, {"t": 0.0, "q": [0.1], "p": [0.2], **more}),
        Call("compiled H", canonical.hamiltonian, {"t": 0.0, "x": [0.1, 0.2], **more}),
        Call("canonical explicit", momenta.explicit, {"expression": momenta.function}),
        Call("lambdified canonical", momenta.lambdify(), {"q": [0.1], "p": [0.2], "t": 0.0, "parameters": values}),
        Call("compiled mass matrix", inertia.__call__, tree),
        Call("compiled inverse dynamics", forces.__call__, {**tree, "udot": [0.3]}),
        Call("compiled hybrid dynamics", hybrid.__call__, {**tree, "udot": [0.3]}),
        Call("function at a state", asked.__call__, {**tree, "out": None, "threads": 1, "sparse": False}),
        Call("Function", asked.derivative, {"by": "q", "inputs": None}),
        Call("with derivatives", partial(asked.with_derivatives, "q"), {"of": "udot", "inputs": None}),
        Call("vjp", partial(_vjp, asked), {"weights": [1.0]}),
        Call("ode", asked.ode().__call__, {"t": 0.0, "x": [0.1, 0.2]}),
        Call("jac", asked.ode().jac, {"t": 0.0, "x": [0.1, 0.2]}),
        Call("stepper", prepared.stepper, {"dt": 0.1, "count": None}, slow=True),
        Call("Stepper", sim.step, {"inputs": {"F": 1.0}}, slow=True),
        Call("reset", sim.reset, {"initial": {"theta": 0.1}, "parameters": {"m": 2}, "inputs": [1.0]}, slow=True),
        Call("StepperState", sim.restore, {"state": sim.state}),
        Call("lambdify", equations.lambdify, {"result": "terms"}, slow=True),
        Call("lambdified terms", equations.lambdify("terms"), numeric),
        Call("lambdified accelerations", equations.lambdify(), numeric),
        Call("explicit", equations.explicit, {"expression": equations.forcing}),
    ]


def _vjp(function: mbs.Function, weights: Any) -> Any:
    return function.vjp(0.0, [0.1], [0.2], by="q", weights={"udot": weights})


def _results(system: mbs.System) -> list[Call]:
    """Return the records that come back, made by hand, and what can be asked of them."""
    records = [mbs.CheckReport, mbs.Equilibrium, mbs.Linearization, mbs.Solution, mbs.SymbolicEquations, mbs.Trajectory]
    records += [mbs.CanonicalEquations, mbs.FirstIntegral]
    records += [mbs.Conserved, mbs.Prepared, mbs.Modes, mbs.Multipliers, mbs.RangeOfRest, mbs.LeastForMotion, mbs.Study]
    records += [mbs.FrequencyResponse, mbs.Trim, mbs.Posture, mbs.BaseParameters]
    records += [mbs.Figure, mbs.Animation, mbs.LivePage, mbs.Report, mbs.Samples]
    records += [mbs.OrdinaryEquations, mbs.OperationCount]
    records += [mbs.Rates, mbs.CanonicalRates, mbs.HybridForces, mbs.EnergyResults, mbs.MomentumResults]
    records += [mbs.CentroidalMomentum, mbs.ConstraintTerms, mbs.FrameMotion, mbs.FrameJacobian, mbs.OperationalSpace]
    records += [mbs.Regressor, mbs.ImpactResults]
    made = [Call(cls.__name__, cls, dict.fromkeys(inspect.signature(cls).parameters, ())) for cls in records]
    run = mbs.simulate(system, t_end=0.02, samples=2, backend="python")
    study = mbs.sweep(system, {"m": [1, 2]}, t_end=0.02, samples=2, backend="python")
    prepared = mbs.prepare(system, t_end=0.02, samples=2, backend="python")
    again = {"parameters": {"m": 2}, "initial": {"theta": 0.1}, "inputs": {"F": 0}, "t_end": 0.01, "on_progress": None}
    figure, report = mbs.draw(system), _without_compiler(mbs.report, "multibody_sym.documents.report_content")
    live = _without_compiler(mbs.live, "multibody_sym.documents.animation.live")
    return [
        *made,
        Call("figure.write", figure.write, {"path": "figure.svg"}),
        Call("figure.content", figure.content, {"ending": ".svg"}),
        Call("prepared.run", prepared.run, again, slow=True),
        Call("UrdfNotice", _notice, {"text": "told"}),
        Call("StudyNotice", _study_notice, {"text": "told"}),
        Call("run(t)", run.__call__, {"t": 0.01, "before": False}, slow=True),
        Call("run[name]", run.__getitem__, {"name": "theta"}),
        Call("run.plot", run.plot, {"path": None, "show": "theta", "x": "t"}, slow=True),
        Call("live", live, {"system": system, "path": None, "view": None}, slow=True),
        Call("animate", mbs.animate, {"run": run, "path": None, "trace": None, "view": None, "speed": 1.0}, slow=True),
        Call("report", report, {"system": system, "path": None, "units": None, "digits": 4, "numbers": 1}, slow=True),
        Call("plot", mbs.plot, {"runs": run, "path": None, "show": "theta", "x": "t"}, slow=True),
        Call("study[name]", study.__getitem__, {"name": "theta end"}),
        Call("study.plot", study.plot, {"path": None, "show": None}, slow=True),
        *(Call(f"t {sign} x", function, {"x": 1}) for sign, function in _OPERATORS.items()),
    ]


def _notice(text: Any) -> Any:
    return mbs.UrdfNotice(text)


def _study_notice(text: Any) -> Any:
    return mbs.StudyNotice(text)


_OPERATORS: dict[str, Callable[[Any], Any]] = {
    "+": lambda x: mbs.t + x, "-": lambda x: mbs.t - x, "*": lambda x: mbs.t * x, "/": lambda x: mbs.t / x,
    "**": lambda x: mbs.t**x, "<": lambda x: mbs.t < x, "<=": lambda x: mbs.t <= x, "==": lambda x: mbs.t == x,
    "r+": lambda x: x + mbs.t, "r-": lambda x: x - mbs.t, "r/": lambda x: x / mbs.t, "r**": lambda x: x**mbs.t,
}


def not_called(known: list[Call]) -> list[str]:
    """Return the public callables, and fields of elements, that stand in no call."""
    given = {call.name: call.given for call in known}
    names = [name for name in mbs.__all__ if callable(getattr(mbs, name))]
    missing = [name for name in names if name not in given]
    for name in _ELEMENTS:
        missing += [f"{name}.{x}" for x in inspect.signature(getattr(mbs, name)).parameters if x not in given[name]]
    return missing
