"""Deriving and printing the Program of a spatial chain of revolute joints, all its numbers symbols.

    python benchmarks/chains.py [bodies ...]

Per number of bodies: time from the mechanism to the Program, from the Program to C, both minimum of five, operations
and bytes of source. Each body has 13 parameters: mass, centre of mass, inertia, and the place of the next joint.
"""

from __future__ import annotations

import sys
import time
from importlib.metadata import version

from multibody_sym.codegen.c import c_source
from multibody_sym.dynamics.formalisms import FORMALISMS, cheapest
from multibody_sym.dynamics.programs import state_derivative
from multibody_sym.kinematics.state import slot_state
from multibody_sym.model.elements import Body
from multibody_sym.model.joints import Revolute
from multibody_sym.model.resolve import mechanism
from multibody_sym.model.system import System
from multibody_sym.program.measures import operation_count

ROUNDS = 5
INERTIA = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


def chain(count: int) -> System:
    """Return a chain whose axes alternate between x, y and z."""
    parameters, bodies, joints = {}, {}, {}
    for k in range(count):
        names = {key: f"{key}{k}" for key in ("m", "cx", "cy", "cz", *INERTIA, "px", "py", "pz")}
        parameters.update(dict.fromkeys(names.values(), 1))
        bodies[f"body{k}"] = Body(
            mass=names["m"],
            com=[names["cx"], names["cy"], names["cz"]],
            inertia={key: names[key] for key in INERTIA},
            points={"end": [names["px"], names["py"], names["pz"]]},
        )
        joints[f"joint{k}"] = Revolute(f"body{k - 1}.end" if k else "ground", f"body{k}", axis="xyz"[k % 3])
    return System("chain", gravity=[0, 0, -9.81], parameters=parameters, bodies=bodies, joints=joints)


def measure(count: int) -> str:
    """Return one row of the table."""
    resolved = mechanism(chain(count))
    formalism = FORMALISMS[cheapest(resolved)]
    derived, printed = [], []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        program = state_derivative(resolved, formalism(resolved, slot_state(resolved)))
        middle = time.perf_counter()
        source = c_source({"state_derivative": program})
        printed.append(time.perf_counter() - middle)
        derived.append(middle - start)
        operations, size = operation_count(program).total, len(source["model.c"])
        del program, source
    total = min(a + b for a, b in zip(derived, printed, strict=True))
    return f"{count:6} {min(derived):9.3f} {min(printed):9.3f} {total:9.3f} {operations:11} {size:10}"


def main() -> None:
    """Print the table."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}")
    print("bodies  derive s   print s   total s  operations     bytes")
    for count in [int(word) for word in sys.argv[1:]] or [1, 3, 10, 30, 100]:
        print(measure(count))


if __name__ == "__main__":
    main()
