"""Runs of models with `states:` against scipy's Radau on the same equations written by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

PRESSURE = """
multibody_sym: 1
name: cylinder
gravity: [0, 0, 0]
parameters: {m: 100 kg, A: 5 cm^2, V: 100 cm^3, E: 1.4 GPa, ref: 0.1 m, kv: 0.002 m^2/s, c: 2000 N*s/m}
bodies: {rod: {mass: m}}
joints: {P: {type: prismatic, parent: ground, child: rod, axis: x, q: s}}
states: {p: {rate: "E/V*(kv*(ref - s) - A*u_s)", initial: 1 bar}}
forces: {oil: {type: force, on: rod, value: [p*A, 0, 0]}, d: {type: damper, joint: P, damping: c}}
simulation: {t_end: 0.5 s}
"""

SWING = """
multibody_sym: 1
name: NAME
gravity: [0, -g, 0]
parameters: {m: 1, l: 0.5, g: 9.81}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: 0.5}}}
forces: {motor: {type: torque, joint: hinge, value: TORQUE}}
simulation: {t_end: 2}
"""

SLIDE = """
multibody_sym: 1
name: NAME
gravity: [0, 0, 0]
bodies: {block: {mass: 2}}
joints: {rail: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {q: 0.3, u: 1}}}
simulation: {t_end: 2}
"""


def swing(phi: float, u: float, torque: float) -> list[float]:
    return [u, (torque - 9.81 * 0.5 * np.sin(phi)) / 0.25]


def pid(t: float, x: Any) -> list[float]:
    """A PID controller with a bounded torque, whose integral stands still in proportion to what the bound takes."""
    phi, u, e = x
    wanted = 20 * (1 - phi) + 15 * e - 2 * u
    bounded = min(max(wanted, -6.0), 6.0)
    return [*swing(phi, u, bounded), (1 - phi) + 0.8 * (bounded - wanted)]


def quaternion(t: float, x: Any) -> Any:
    """A free body turned by three lagging motors in its own axes."""
    q, w, tau = x[:4], x[4:7], x[7:]
    I = np.array([1.0, 2.0, 3.0])
    rate = 0.5 * np.array(
        [
            -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
            q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
            q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
            q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
        ]
    )
    wanted = np.array([np.sin(t), -w[1], 1.0])
    return [*rate, *((tau - np.cross(w, I * w)) / I), *((wanted - tau) / np.array([0.1, 0.2, 0.3]))]


class Case(NamedTuple):
    """A model, its columns, and x' = f(t, x) of these from x0 on."""

    model: str
    columns: tuple[str, ...]
    rates: Callable[[float, Any], Any]
    x0: tuple[float, ...]


CASES = {
    "hydraulic cylinder": Case(
        PRESSURE,
        ("s", "u_s", "p"),
        lambda t, x: [x[1], (x[2] * 5e-4 - 2000 * x[1]) / 100, 1.4e13 * (0.002 * (0.1 - x[0]) - 5e-4 * x[1])],
        (0.0, 0.0, 1e5),
    ),
    "filtered torque": Case(
        SWING.replace("TORQUE", "tau") + "states: {tau: {rate: (-3*phi - tau)/0.2, initial: 1}}",
        ("phi", "u_phi", "tau"),
        lambda t, x: [*swing(x[0], x[1], x[2]), (-3 * x[0] - x[2]) / 0.2],
        (0.5, 0.0, 1.0),
    ),
    "PID with anti-windup": Case(
        SWING.replace("TORQUE", "tau")
        + 'states: {e: {rate: "1 - phi + 0.8*(tau - wanted)", initial: 0}}\n'
        + 'inputs: {wanted: 20*(1 - phi) + 15*e - 2*u_phi, tau: "min(max(20*(1 - phi) + 15*e - 2*u_phi, -6), 6)"}',
        ("phi", "u_phi", "e"),
        pid,
        (0.5, 0.0, 0.0),
    ),
    "motor current": Case(
        SWING.replace("TORQUE", "0.4*i")
        + "inputs: {V: 12*sin(3*t)}\nstates: {i: {rate: (V - 1.5*i - 0.4*u_phi)/0.02, initial: 0.5}}",
        ("phi", "u_phi", "i"),
        lambda t, x: [*swing(x[0], x[1], 0.4 * x[2]), (12 * np.sin(3 * t) - 1.5 * x[2] - 0.4 * x[1]) / 0.02],
        (0.5, 0.0, 0.5),
    ),
    "two filters of a table": Case(
        SLIDE
        + "inputs: {F: {table: [[0, 0], [0.5, 4], [2, -1]], interpolation: cubic}}\n"
        + "states: {f1: {rate: (F - f1)/0.1, initial: 0}, f2: {rate: (f1 - f2)/0.3, initial: 2}}\n"
        + "forces: {push: {type: force, on: block, value: [f2, 0, 0]}}",
        ("x", "u_x", "f1", "f2"),
        lambda t, x: [x[1], x[3] / 2, (natural_spline(t) - x[2]) / 0.1, (x[2] - x[3]) / 0.3],
        (0.3, 1.0, 0.0, 2.0),
    ),
    "bristles": Case(
        SLIDE
        + "states: {z: {rate: u_x - 40*z*abs(u_x), initial: 0}}\n"
        + "forces: {rub: {type: force, on: block, value: [-30*z + cos(4*t), 0, 0]}}",
        ("x", "u_x", "z"),
        lambda t, x: [x[1], (np.cos(4 * t) - 30 * x[2]) / 2, x[1] - 40 * x[2] * abs(x[1])],
        (0.3, 1.0, 0.0),
    ),
    "oil that warms up": Case(
        SLIDE
        + "inputs: {c: 3*exp(-T/20)}\n"
        + "states: {T: {rate: (c*u_x^2 - 0.2*T)/0.5, initial: 20}}\n"
        + "forces: {d: {type: damper, joint: rail, damping: c}, k: {type: spring_damper, joint: rail, stiffness: 8}}",
        ("x", "u_x", "T"),
        lambda t, x: [
            x[1],
            (-8 * x[0] - 3 * np.exp(-x[2] / 20) * x[1]) / 2,
            (3 * np.exp(-x[2] / 20) * x[1] ** 2 - 0.2 * x[2]) / 0.5,
        ],
        (0.3, 1.0, 20.0),
    ),
    "a drive whose speed lags": Case(
        SLIDE.replace("initial: {q: 0.3, u: 1}", "initial: {q: 0.3}")
        + "states: {v: {rate: (sin(t) - v)/0.4, initial: 1}}\n"
        + "constraints: {drive: {type: velocity, zero: u_x - v}}\n"
        + "outputs: {F: multiplier(drive)}",
        ("x", "v", "u_x"),
        lambda t, x: [x[1], (np.sin(t) - x[1]) / 0.4, (np.sin(t) - x[1]) / 0.4],
        (0.3, 1.0, 1.0),
    ),
    "an observer": Case(
        SLIDE
        + "forces: {k: {type: spring_damper, joint: rail, stiffness: 8, damping: 1}}\n"
        + "states:\n  xh: {rate: vh + 6*(x - xh), initial: 0}\n"
        + "  vh: {rate: (-8*xh - vh)/2 + 9*(x - xh), initial: 0}",
        ("x", "u_x", "xh", "vh"),
        lambda t, x: [
            x[1],
            (-8 * x[0] - x[1]) / 2,
            x[3] + 6 * (x[0] - x[2]),
            (-8 * x[2] - x[3]) / 2 + 9 * (x[0] - x[2]),
        ],
        (0.3, 1.0, 0.0, 0.0),
    ),
    "a satellite": Case(
        """
multibody_sym: 1
name: satellite
gravity: [0, 0, 0]
bodies: {sat: {mass: 1, inertia: {Ixx: 1, Iyy: 2, Izz: 3}}}
joints: {B: {type: spherical, parent: ground, child: sat, initial: {u: [0.1, 0.7, -0.2]}}}
states:
  a: {rate: (sin(t) - a)/0.1, initial: 0}
  b: {rate: (-B_wy - b)/0.2, initial: 1}
  c: {rate: (1 - c)/0.3, initial: 0}
forces: {motors: {type: torque, on: sat, value: [a, b, c], frame: sat}}
simulation: {t_end: 2}
""",
        ("B_qw", "B_qx", "B_qy", "B_qz", "B_wx", "B_wy", "B_wz", "a", "b", "c"),
        quaternion,
        (1.0, 0.0, 0.0, 0.0, 0.1, 0.7, -0.2, 0.0, 1.0, 0.0),
    ),
    "a state that nothing feels": Case(
        SLIDE + "states: {work: {rate: 4*u_x^2 + work0, initial: -2}}\nparameters: {work0: 1}\n"
        "forces: {d: {type: damper, joint: rail, damping: 4}}",
        ("x", "u_x", "work"),
        lambda t, x: [x[1], -2 * x[1], 4 * x[1] ** 2 + 1],
        (0.3, 1.0, -2.0),
    ),
}


def natural_spline(t: float) -> float:
    """The natural cubic spline through (0, 0), (0.5, 4), (2, -1)."""
    m = 6 * ((-1 - 4) / 1.5 - (4 - 0) / 0.5) / (2 * (0.5 + 1.5))  # its second derivative at 0.5
    if t <= 0.5:
        return m * t**3 / (6 * 0.5) + (4 - 0 - m * 0.25 / 6) * t / 0.5
    r = 2.0 - t
    return m * r**3 / (6 * 1.5) + (4 - m * 2.25 / 6) * r / 1.5 - (t - 0.5) / 1.5


def by_hand(case: Case, times: Any, **options: Any) -> Any:
    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12, **options}
    found = solve_ivp(case.rates, (0.0, times[-1]), case.x0, t_eval=times, **tight)
    assert found.success
    return found.y


def missed(run: Any, case: Case, wanted: Any) -> float:
    """Return the largest difference, as a part of the largest value in its column."""
    found = np.array([run[name] for name in case.columns])
    return float((np.abs(found - wanted).max(axis=1) / np.abs(wanted).max(axis=1)).max())


@pytest.mark.parametrize("name", CASES)
def test_runs_are_those_of_the_equations_written_by_hand(name: str) -> None:
    case = CASES[name]
    system = mbs.loads(case.model.replace("NAME", "model"))
    run = mbs.simulate(system, samples=21, rtol=1e-11, atol=1e-12)
    stiff = {"method": "Radau", "atol": [1e-14, 1e-14, 1e-8]}
    wanted = by_hand(case, run.t, **(stiff if name == "hydraulic cylinder" else {}))
    assert missed(run, case, wanted) < 1e-8
    again = mbs.simulate(system, samples=21, method="radau_5", rtol=1e-11, atol=1e-12)  # by its Jacobian
    assert missed(again, case, wanted) < 1e-8


# --- modes, events, impacts ------------------------------------------------------------------------------------------



@pytest.mark.parametrize(
    ("rate", "force", "message"),
    [
        ("1/p", "0", "states.p.rate: 1/p has no finite value with p = 0"),
        ("sqrt(1 - t)", "0", r"t = 1 s: states.p.rate: sqrt\(1 - t\) has no finite value with t = 1"),
        ("(p + 1)^2", "0", "p grows without bound there.*look for a wrong sign in states.p.rate"),
        ("0", "log(x)", "forces.push.value.0: log.x. has no finite value with x = -"),
    ],
)
def test_a_rate_or_a_force_without_a_value_is_named(rate: str, force: str, message: str) -> None:
    """x falls to zero before 1 s, 1/(1 - t) is p + 1."""
    system = mbs.System(
        "slider",
        gravity=[0, 0, 0],
        bodies={"body": mbs.Body(mass=1)},
        joints={"rail": mbs.Prismatic("ground", "body", axis="x", q="x", initial={"q": 1, "u": -1})},
        states={"p": mbs.StateVariable(rate=rate, initial=0)},
        forces={"push": mbs.Force("body", [force, 0, 0])},
        simulation={"t_end": 2, "samples": 5},
    )
    for run in (mbs.prepare(system).run, mbs.prepare(system).stepper(2).step):
        with pytest.raises(mbs.MotionEndsError, match=message):
            run()


def test_states_are_continuous_over_impacts() -> None:
    system = mbs.loads(
        """
multibody_sym: 1
name: ball
gravity: [0, -10, 0]
bodies: {ball: {mass: 2}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {j: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {q: 1}}}
states: {f: {rate: (3*t - f)/0.5, initial: 4}, n: {rate: u_y, initial: 0}}
contacts: {c: {between: [ball, ground.floor], restitution: 0.6}}
forces: {lift: {type: force, on: ball, value: [0, f, 0]}}
simulation: {t_end: 1.5, samples: 31, rtol: 1e-11, atol: 1e-12}
"""
    )
    run = mbs.simulate(system)

    def rates(t: float, x: Any) -> list[float]:
        return [x[1], x[2] / 2 - 10, (3 * t - x[2]) / 0.5]

    def floor(t: float, x: Any) -> float:
        return x[0] if t > start + 1e-6 else 1.0

    floor.terminal = True  # type: ignore[attr-defined]
    start, x, wanted = 0.0, np.array([1.0, 0.0, 4.0]), []
    impacts = []
    while start < 1.5:
        tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "dense_output": True}
        leg = solve_ivp(rates, (start, 1.5), x, events=floor, **tight)
        wanted += [leg.sol(t) for t in run.t if start <= t < leg.t[-1] or (leg.t[-1] == 1.5 == t)]
        start, x = leg.t[-1], leg.y[:, -1] * [1, -0.6, 1]
        impacts.append(start)
    assert len(impacts) > 2
    assert np.allclose([e["t"] for e in run.events if e["kind"] == "impact"], impacts[:-1], rtol=0, atol=1e-9)
    found = np.array([run["y"], run["u_y"], run["f"]])
    assert np.abs(found - np.array(wanted).T).max() < 1e-8
    assert np.abs(run["n"] - (run["y"] - 1)).max() < 1e-9  # the integral of the speed, which jumps


def test_a_force_that_grows_makes_a_block_slip() -> None:
    """It sticks until the force f = 6 (1 - exp(-t)) passes 0.4*9 = 3.6, then slides against 0.3*9 = 2.7."""
    system = mbs.loads(
        """
multibody_sym: 1
name: block
gravity: [0, -9, 0]
bodies: {block: {mass: 1}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {j: {type: point, parent: ground, child: block, q: [x, y]}}
states: {f: {rate: 6 - f, initial: 0}}
contacts: {c: {between: [block, ground.floor], static: 0.4, kinetic: 0.3}}
forces: {pull: {type: force, on: block, value: [f, 0, 0]}}
stop: {far: x > 2}
simulation: {t_end: 5, samples: 41, rtol: 1e-11, atol: 1e-12}
"""
    )
    begun = np.log(6 / 2.4)
    for method in ("dormand_prince", "radau_5"):
        run = mbs.simulate(system, method=method)
        (slip,) = [e["t"] for e in run.events if e["kind"] == "slide+"]
        assert abs(slip - begun) < 1e-8
        late = run.t > begun
        s = run.t[late] - begun
        assert np.abs(run["x"][late] - (3.3 * s**2 / 2 - 2.4 * (np.exp(-s) - 1 + s))).max() < 1e-8
        assert abs(run.final["coordinates"]["x"] - 2) < 1e-9


# --- functions, linearisation, equilibrium, other answers ------------------------------------------------------------


def differences(f: Callable[[Any], Any], x: Any) -> Any:
    """Return df/dx by central differences of order 4."""
    columns = []
    for k in range(len(x)):
        h = np.zeros(len(x))
        h[k] = 1e-3 * max(1.0, abs(x[k]))
        columns.append((8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h[k]))
    return np.array(columns).T


@pytest.mark.parametrize("name", ["motor current", "oil that warms up", "a drive whose speed lags", "a satellite"])
def test_functions_have_states_behind_coordinates_and_derivatives_by_them(name: str) -> None:
    case = CASES[name]
    system = mbs.loads(case.model.replace("NAME", "model"))
    f = mbs.function(system, "state_derivative")
    run = mbs.simulate(system, samples=3, t_end=1)
    q, u = run.q[1], run.u[1]
    found = f(0.5, q, u)
    order = [*run.coordinates, *run.speeds]
    x = np.array([run[c][1] for c in case.columns])
    wanted = dict(zip(case.columns, case.rates(0.5, x), strict=True))
    assert np.allclose([*found.qdot, *found.udot], [wanted[c] for c in order], rtol=1e-9, atol=1e-11)
    rhs, at = f.ode(), np.concatenate([q, u])
    assert np.allclose(rhs(0.5, at), [wanted[c] for c in order], rtol=1e-9, atol=1e-11)
    assert np.allclose(rhs.jac(0.5, at), differences(lambda x: rhs(0.5, x), at), rtol=1e-7, atol=1e-7)
    by_s = f.derivative("s")(0.5, q, u)
    ns = by_s.qdot.shape[-1]
    assert ns == len(system.states)
    tails = differences(lambda s: np.concatenate(f(0.5, np.append(q[:-ns], s), u)[:2]), q[-ns:])
    assert np.allclose(np.concatenate([by_s.qdot, by_s.udot]), tails, rtol=1e-7, atol=1e-8)
    with pytest.raises(mbs.InputError, match="no function of 's'"):
        mbs.function(mbs.loads(SLIDE), "state_derivative").derivative("s")


def test_a_linearisation_has_columns_of_states() -> None:
    """About rest: phi'' = (k tau - m g l phi)/(m l^2), tau' = (w - tau)/T, e' = phi."""
    system = mbs.loads(
        SWING.replace("TORQUE", "tau").replace("q: 0.5", "q: 0")
        + "states: {tau: {rate: (w - tau)/0.2, initial: 0}, e: {rate: phi, initial: 0}}\ninputs: {w: -5*e}"
    )
    found = mbs.linearize(system)
    assert found.states == ("phi", "u_phi", "tau", "e")
    assert np.allclose(found.A, [[0, 1, 0, 0], [-19.62, 0, 4, 0], [0, 0, -5, -25], [1, 0, 0, 0]], atol=1e-13)
    assert np.allclose(found.B.T, [[0, 0, 5, 0]])
    wanted = np.roots([1, 5, 19.62, 5 * 19.62, 25 * 4])
    assert np.allclose(np.sort_complex(found.eigenvalues), np.sort_complex(wanted), atol=1e-9)
    assert mbs.equilibrium(system).stable == (False,)


def test_rest_is_where_rates_vanish_too() -> None:
    rest = mbs.equilibrium(mbs.loads(PRESSURE))
    assert len(rest.positions) == 1
    assert rest.stable == (True,)
    assert rest.positions[0] == pytest.approx({"s": 0.1, "p": 0.0}, abs=1e-6)
    # a magnet that holds a ball: m g = k i^2/x^2, V = R i; the integral of what is missed begins anywhere
    held = mbs.loads(
        """
multibody_sym: 1
name: magnet
gravity: [0, 0, 9.81]
bodies: {ball: {mass: 0.05}}
joints: {j: {type: prismatic, parent: ground, child: ball, axis: z, q: z, initial: {q: 0.012}}}
states: {i: {rate: (V - 8*i)/0.4, initial: 0.5}, e: {rate: z - 0.01, initial: 0}}
inputs: {V: 4000*(z - 0.01) + 60*u_z + 800*e}
forces: {pull: {type: force, on: ball, value: [0, 0, -1e-4*i^2/z^2]}}
"""
    )
    current = 0.01 * np.sqrt(0.05 * 9.81 / 1e-4)
    found = mbs.equilibrium(held).positions  # it pulls with either sign of the current
    assert len(found) == 2
    for position, i in zip(found, (current, -current), strict=True):
        assert position == pytest.approx({"z": 0.01, "i": i, "e": 8 * i / 800}, rel=1e-9)
    assert np.abs(mbs.linearize(held, at="equilibrium").accelerations["i"]) < 1e-9


@pytest.mark.parametrize(("rate", "start", "roots"), [
    ("p - p^3", "0", (0, 1, -1)),
    ("-(p - 5)*(p + 3)*(p - 0.5)", "1", (0.5, 5, -3)),
    ("1e-7*p*(1e5 - p)", "1e4", (0, 1e5)),
])  # fmt: skip
def test_equilibrium_varies_states_as_it_does_coordinates(rate: str, start: str, roots: tuple[float, ...]) -> None:
    """A valve with several states of rest holds a spring at each: stable where the rate falls."""
    text = f"""
multibody_sym: 1
name: valve
bodies: {{block: {{mass: 2}}}}
joints: {{guide: {{type: prismatic, parent: ground, child: block, axis: x, q: x}}}}
forces: {{law: {{type: force, on: block, value: [p/{max(roots)} - 3*x - u_x, 0, 0]}}}}
states: {{p: {{rate: "{rate}", initial: {start}}}}}
"""
    found = mbs.equilibrium(mbs.loads(text))
    rests = {round(x["p"], 6): (x["x"], stable) for x, stable in zip(found.positions, found.stable, strict=True)}
    assert sorted(rests) == pytest.approx(sorted(roots), abs=1e-6)
    for p, (x, stable) in rests.items():
        assert x == pytest.approx(p / 3 / max(roots), rel=1e-9, abs=1e-9)
        slope = [eval(rate.replace("^", "**"), {"p": p + by}) for by in (1e-3, -1e-3)]
        assert stable == (slope[0] < slope[1])


def test_states_alone_have_an_equilibrium() -> None:
    text = "multibody_sym: 1\nname: filter\nbodies: {b: {mass: 1}}\n"
    text += "joints: {J: {type: fixed, parent: ground, child: b}}\nstates: {p: {rate: 2 - 4*p, initial: 0}}\n"
    found = mbs.equilibrium(mbs.loads(text))
    assert (found.positions, found.stable) == (({"p": 0.5},), (True,))


def test_trim_finds_states_and_inputs_that_hold_a_position() -> None:
    held = mbs.loads(CASES["motor current"].model.replace("NAME", "model"))
    found = mbs.trim(held, at={"phi": 0.3}, unknown=["V"])
    current = 9.81 * 0.5 * np.sin(0.3) / 0.4
    assert found.state == pytest.approx({"phi": 0.3, "i": current, "u_phi": 0.0}, rel=1e-10)
    assert found.inputs == pytest.approx({"V": 1.5 * current}, rel=1e-10)
    cylinder = PRESSURE.replace("value: [p*A, 0, 0]", "value: [p*A - 50, 0, 0]").replace("ref - s", "w - s")
    found = mbs.trim(mbs.loads(cylinder + "inputs: {w: 0.1 m}"), at={"s": 0.2})
    assert found.state == pytest.approx({"s": 0.2, "p": 50 / 5e-4, "u_s": 0.0}, rel=1e-9)
    assert found.inputs == pytest.approx({"w": 0.2}, rel=1e-9)


def test_long_chains_keep_their_states() -> None:
    """Scanned as bodies of one kind, and written out: a lagging torque, and the work of a joint."""
    chain = mbs.loads(
        """
multibody_sym: 1
name: chain
gravity: [0, -9.81, 0]
repeat:
  count: 12
  body: {mass: 1, com: [0, -0.5, 0], inertia: {Ixx: 0.1, Iyy: 0.2, Izz: 0.1}, points: {end: [0, -1, 0]}}
  joint: {type: spherical, parent: end}
forces: {tau: {type: torque, joint: joint1, freedom: joint1_wz, value: w}}
states: {w: {rate: (30*sin(t) - w)/0.1, initial: 1}, n: {rate: joint3_wz, initial: 2}}
simulation: {t_end: 0.5, samples: 3, rtol: 1e-10}
"""
    )
    scanned, written = (mbs.simulate(chain, formalism=name) for name in ("block_ldl", "composite_body"))
    assert np.abs(scanned.q - written.q).max() < 1e-8
    lag = 30 * (np.sin(0.5) - 0.1 * np.cos(0.5) + 0.1 * np.exp(-5)) / 1.01 + np.exp(-5)
    assert scanned["w"][-1] == pytest.approx(lag, rel=1e-9)
    assert scanned["n"][-1] != 2


def test_solve_and_derive_tell_the_rates() -> None:
    system = mbs.loads(PRESSURE)
    rate = mbs.solve(system).rates["p"]
    assert rate.value == pytest.approx(2.8e9)
    assert rate.unit == "Pa/s"
    for method in ("lagrange", "newton_euler", "composite_body", "multipliers"):
        equations = mbs.derive(system, method)
        assert str(equations).splitlines()[-1] == "p' = E*(kv*(ref - s) - A*s')/V"
        q, u = [0.03, 2e5], [0.1]
        assert equations.lambdify()(q, u) == pytest.approx([(2e5 * 5e-4 - 200) / 100])
    for method in ("hamilton", "routh"):
        with pytest.raises(mbs.ModelError, match=r"'p' is a state beside the motion: canonical"):
            mbs.derive(system, method)
    with pytest.raises(mbs.ModelError, match="stoermer_6 takes equations of second order only"):
        mbs.simulate(system, method="stoermer_6", step=1e-3)
    with pytest.raises(mbs.ModelError, match="has no normal modes; linearize"):
        mbs.modes(system)


def test_states_begin_where_a_call_says_and_vary_in_studies() -> None:
    system = mbs.loads(PRESSURE)
    assert mbs.simulate(system, initial={"p": "2 bar"}, samples=2).q[0, 1] == pytest.approx(2e5)
    with pytest.raises(mbs.InputError, match=r"'2 m' does not fit here: expected a quantity in Pa"):
        mbs.simulate(system, initial={"p": "2 m"})
    with pytest.raises(mbs.InputError, match="a state needs a value at the start"):
        mbs.simulate(system, initial={"p": None})
    study = mbs.sweep(system, {"p": ["1 bar", "2 bar"]}, t_end=0.01)
    alone = [mbs.simulate(system, initial={"p": p}, t_end=0.01).final["coordinates"]["p"] for p in ("1 bar", "2 bar")]
    assert np.allclose(study["p end"], alone, rtol=1e-12)


def test_no_energy_is_conserved_that_a_state_changes() -> None:
    model = CASES["filtered torque"].model.replace("NAME", "model").replace("initial: 1", "initial: 0")
    found = mbs.check(mbs.loads(model))
    assert found.conserved == ()
    assert max(found.agreement.values()) < 10


def test_python_declares_states_as_files_do() -> None:
    read = mbs.loads(PRESSURE)
    p, s, u_s = (mbs.variable(name) for name in ("p", "s", "u_s"))
    m, A, V, E, ref, kv, c = mbs.parameters(
        "m A V E ref kv c", ["100 kg", "5 cm^2", "100 cm^3", "1.4 GPa", "0.1 m", "0.002 m^2/s", "2000 N*s/m"]
    )
    system = mbs.System(
        "cylinder",
        gravity=[0, 0, 0],
        bodies={"rod": mbs.Body(mass=m)},
        joints={"P": mbs.Prismatic("ground", "rod", axis="x", q="s")},
        states={"p": mbs.StateVariable(rate=E / V * (kv * (ref - s) - A * u_s), initial="1 bar")},
        forces={
            "oil": mbs.Force(on="rod", value=[p * A, 0, 0]),
            "d": mbs.Damper(joint="P", damping=c),
        },
        simulation={"t_end": "0.5 s"},
    )
    assert system.states == read.states
    assert mbs.loads(mbs.dumps(system)).states == read.states
    options: dict[str, Any] = {"samples": 3, "t_end": 0.1}
    assert mbs.simulate(system, **options)["p"].tolist() == mbs.simulate(read, **options)["p"].tolist()
