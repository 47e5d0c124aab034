"""Closed forms of chains: deriving them here and with sympy.physics.mechanics, in one run on one machine.

    python benchmarks/derivation.py [--limit SECONDS] [--planar N ...] [--spatial N ...]

The planar chain has point masses and relative angles, parameters m, l of each link and g. The spatial chain has
revolute joints about alternating axes and 13 parameters a body: mass, centre of mass, inertia, place of the next joint.
Times are processor time, the minimum of three after imports, with sympy's cache emptied before each, from the declared
model to mass matrix and forcing. Rounds that the limit (wall time, all rounds together) cuts off do not count; a method
without a single round within it is not asked for longer chains.
"""

from __future__ import annotations

import argparse
import multiprocessing
import platform
import time
from collections.abc import Callable, Iterable
from importlib.metadata import version
from typing import Any, Final

import sympy
from sympy.core.cache import clear_cache
from sympy.physics import mechanics

from multibody_sym.derivation.derive import derive
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Revolute
from multibody_sym.model.system import System

ROUNDS: Final = 3
INERTIA: Final = {"Ixx": 1, "Iyy": 1, "Izz": 1, "Ixy": 0, "Iyz": 0, "Ixz": 0}
LENGTHS: Final = {"planar": (2, 3, 5, 7, 10, 15, 20), "spatial": (2, 3, 4, 5, 6, 7, 8)}


# --- the chains, declared here -------------------------------------------------------------------------------------


def planar(links: int) -> System:
    """Return point masses one below the other."""
    parameters: dict[str, Any] = {"g": 9.81}
    bodies, joints = {}, {}
    for k in range(links):
        parameters |= {f"m{k}": 1, f"l{k}": 1}
        bodies[f"link{k}"] = Body(mass=f"m{k}", com=[0, f"-l{k}", 0], points={"end": [0, f"-l{k}", 0]})
        joints[f"hinge{k}"] = Revolute(f"link{k - 1}.end" if k else "ground", f"link{k}", q=f"q{k}")
    return System("planar", gravity=[0, "-g", 0], parameters=parameters, bodies=bodies, joints=joints)


def spatial(links: int) -> System:
    """Return rigid bodies whose hinges turn about x, y and z by turns."""
    parameters: dict[str, Any] = {"g": 9.81}
    bodies, joints = {}, {}
    for k in range(links):
        names = {key: f"{key}{k}" for key in ("m", "cx", "cy", "cz", *INERTIA, "px", "py", "pz")}
        parameters |= {names[key]: INERTIA.get(key, 1) for key in names}
        bodies[f"link{k}"] = Body(
            mass=names["m"],
            com=[names["cx"], names["cy"], names["cz"]],
            inertia={key: names[key] for key in INERTIA},
            points={"end": [names["px"], names["py"], names["pz"]]},
        )
        joints[f"hinge{k}"] = Revolute(f"link{k - 1}.end" if k else "ground", f"link{k}", axis="xyz"[k % 3], q=f"q{k}")
    return System("spatial", gravity=[0, 0, "-g"], parameters=parameters, bodies=bodies, joints=joints)


MODELS: Final[dict[str, Callable[[int], System]]] = {"planar": planar, "spatial": spatial}


# --- the same chains for sympy.physics.mechanics -------------------------------------------------------------------


class Chain:
    """A chain as sympy.physics.mechanics takes it; `speeds` are the rates of q, or speeds of their own."""

    def __init__(self, kind: str, links: int, *, own_speeds: bool) -> None:
        self.q = mechanics.dynamicsymbols(f"q:{links}")
        self.u = mechanics.dynamicsymbols(f"u:{links}") if own_speeds else [q.diff() for q in self.q]
        self.ground, self.origin = mechanics.ReferenceFrame("N"), mechanics.Point("O")
        self.origin.set_vel(self.ground, 0)
        self.down = -self.ground.y if kind == "planar" else -self.ground.z
        self.bodies: list[Any] = []
        frame, point = self.ground, self.origin
        for k in range(links):
            frame, point = (self.hung if kind == "planar" else self.hinged)(k, frame, point)
        g = sympy.Symbol("g")
        self.loads = []
        for b in self.bodies:
            centre = b.masscenter if hasattr(b, "masscenter") else b.point
            self.loads.append((centre, b.mass * g * self.down))
            b.potential_energy = -b.mass * g * centre.pos_from(self.origin).dot(self.down)

    def turned(self, k: int, parent: Any, axis: Any) -> Any:
        """Return the frame of link k, turned by q about an axis of its parent."""
        frame = parent.orientnew(f"F{k}", "Axis", [self.q[k], axis])
        frame.set_ang_vel(parent, self.u[k] * axis)
        return frame

    def hung(self, k: int, parent: Any, point: Any) -> tuple[Any, Any]:
        """Hang a point mass on the last one."""
        m, length = sympy.symbols(f"m{k} l{k}")
        frame = self.turned(k, parent, parent.z)
        end = point.locatenew(f"P{k}", -length * frame.y)
        end.v2pt_theory(point, self.ground, frame)
        self.bodies.append(mechanics.Particle(f"b{k}", end, m))
        return frame, end

    def hinged(self, k: int, parent: Any, point: Any) -> tuple[Any, Any]:
        """Hinge a rigid body to the last one."""
        m, cx, cy, cz, px, py, pz = sympy.symbols(" ".join(f"{s}{k}" for s in "m cx cy cz px py pz".split()))
        frame = self.turned(k, parent, (parent.x, parent.y, parent.z)[k % 3])
        centre = point.locatenew(f"C{k}", cx * frame.x + cy * frame.y + cz * frame.z)
        centre.v2pt_theory(point, self.ground, frame)
        end = point.locatenew(f"P{k}", px * frame.x + py * frame.y + pz * frame.z)
        end.v2pt_theory(point, self.ground, frame)
        inertia = mechanics.inertia(frame, *sympy.symbols(" ".join(f"{s}{k}" for s in INERTIA)))
        self.bodies.append(mechanics.RigidBody(f"b{k}", centre, frame, m, (inertia, centre)))
        return frame, end


def kane(kind: str, links: int) -> None:
    """Derive with sympy's KanesMethod."""
    chain = Chain(kind, links, own_speeds=True)
    rates = [q.diff() - u for q, u in zip(chain.q, chain.u, strict=True)]
    method = mechanics.KanesMethod(chain.ground, q_ind=chain.q, u_ind=chain.u, kd_eqs=rates)
    method.kanes_equations(chain.bodies, chain.loads)
    _ = method.mass_matrix, method.forcing


def lagrange(kind: str, links: int) -> None:
    """Derive with sympy's LagrangesMethod."""
    chain = Chain(kind, links, own_speeds=False)
    method = mechanics.LagrangesMethod(mechanics.Lagrangian(chain.ground, *chain.bodies), chain.q, frame=chain.ground)
    method.form_lagranges_equations()
    _ = method.mass_matrix, method.forcing


METHODS: Final[dict[str, Callable[[str, int], Any]]] = {
    "lagrange": lambda kind, links: derive(MODELS[kind](links), "lagrange"),
    "composite_body": lambda kind, links: derive(MODELS[kind](links), "composite_body"),
    "KanesMethod": kane,
    "LagrangesMethod": lagrange,
}


# --- measuring -----------------------------------------------------------------------------------------------------


def rounds(method: str, kind: str, links: int, found: Any) -> None:
    """Put the times of three derivations into a queue."""
    for _ in range(ROUNDS):
        clear_cache()
        start = time.process_time()
        METHODS[method](kind, links)
        found.put(time.process_time() - start)


def measured(method: str, kind: str, links: int, limit: float) -> float | None:
    """Return the best time, None where not even one derivation ended within the limit."""
    context = multiprocessing.get_context("fork")
    found = context.Queue()
    worker = context.Process(target=rounds, args=(method, kind, links, found))
    worker.start()
    worker.join(limit)
    if worker.is_alive():
        worker.terminate()
        worker.join()
    elif worker.exitcode:
        raise SystemExit(f"{method} failed on the {kind} chain of {links}")
    times = []
    while not found.empty():
        times.append(found.get())
    return min(times, default=None)


def table(kind: str, lengths: Iterable[int], limit: float) -> None:
    """Print the times of one kind of chain."""
    print(f"\n{kind} chain, processor seconds (minimum of {ROUNDS})")
    print(f"{'links':>6}" + "".join(f"{name:>17}" for name in METHODS))
    given_up: set[str] = set()
    for links in lengths:
        cells = []
        for name in METHODS:
            best = None if name in given_up else measured(name, kind, links, limit)
            if best is None:
                given_up.add(name)
            cells.append(f"{best:17.3f}" if best is not None else f"{'> ' + format(limit, 'g'):>17}")
        print(f"{links:6}" + "".join(cells), flush=True)


def main() -> None:
    """Print versions and both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--limit", type=float, default=60.0, metavar="SECONDS", help="for one method and length (60)")
    for kind, lengths in LENGTHS.items():
        parser.add_argument(f"--{kind}", type=int, nargs="*", default=lengths, metavar="N")
    options = parser.parse_args()
    print(f"multibody_sym {version('multibody-sym')}, sympy {version('sympy')}, Python {platform.python_version()}")
    for kind in LENGTHS:
        table(kind, getattr(options, kind), options.limit)


if __name__ == "__main__":
    main()
