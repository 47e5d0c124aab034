"""Operations of a state derivative by the two formalisms that `cheapest` chooses from, all numbers folded.

    python benchmarks/formalisms.py

Chains and binary trees of hinges and of balls, links along their parents' axes or at an odd angle to them; chains of
hinges whose last bodies hang on rods from the ground. The choice is marked with a star.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import version

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import slot_state
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Frame, Turn
from multibody_sym.model.constraints import Distance
from multibody_sym.model.joints import Joint, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.program.program import operation_count

NAMES = ("composite_body", "block_ldl")


def links(count: int, *, balls: bool = False, branched: bool = False, angle: float = 0.0, rods: int = 0) -> Mechanism:
    """Return a chain or binary tree of bodies; `angle` is that between a joint's axes and its parent's."""
    end = Frame([0, 0.1, 0.5], [Turn([1, 2, 3], angle)] if angle else [])
    bodies = {"ground": Body(points={f"p{k}": [1 + k, 0.3, 0.2] for k in range(rods)})}
    joints: dict[str, Joint] = {}
    for k in range(count):
        place = f"body{(k - 1) // 2 if branched else k - 1}.end" if k else "ground"
        bodies[f"body{k}"] = Body(
            mass=1 + k / 10, com=[0.1, 0.02, 0.2], inertia=[0.1, 0.2, 0.25, 0.01, 0.02, 0.03], frames={"end": end}
        )
        body = f"body{k}"
        joints[f"joint{k}"] = Spherical(place, body) if balls else Revolute(place, body, axis="xyz"[k % 3])
    held = {f"rod{k}": Distance([f"ground.p{k}", f"body{count - 1 - k}"], 1) for k in range(rods)}
    return mechanism(System("links", gravity=[0, 0, -9.81], bodies=bodies, joints=joints, constraints=held))


def operations(resolved: Mechanism, formalism: str) -> int:
    """Return the operations of one state derivative."""
    return operation_count(state_derivative(resolved, FORMALISMS[formalism](resolved, slot_state(resolved)))).total


def samples() -> Iterator[tuple[str, Mechanism]]:
    """Yield what is measured, with a title."""
    for branched in (False, True):
        for angle in (0.0, 0.7):
            title = f"{'tree' if branched else 'chain'}{', odd angles' if angle else ''}"
            for count in (3, 5, 7, 8, 9, 12):
                yield f"hinges, {title}", links(count, branched=branched, angle=angle)
            for count in (1, 2, 4):
                yield f"balls, {title}", links(count, balls=True, branched=branched, angle=angle)
    for count in (4, 8, 10, 12, 16):
        yield "hinges, chain, 2 rods", links(count, rods=2)


def main() -> None:
    """Print the table."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}")
    print("                            speeds" + "".join(f"{name:>16}" for name in NAMES))
    for title, resolved in samples():
        chosen = cheapest(resolved)
        counts = "".join(f"{operations(resolved, name):15}{'*' if name == chosen else ' '}" for name in NAMES)
        print(f"{title:27} {len(resolved.speeds):6}{counts}")


if __name__ == "__main__":
    main()
