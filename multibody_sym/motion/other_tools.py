"""A Function in other tools: the order of coordinates of Pinocchio, functions of CasADi and of JAX.

In: a Function's mechanism, Programs and parameters. Out: what the other tool takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.replay import Argument, ToolFunction
from multibody_sym.scalars.arrays import Floats


def pinocchio_order(mechanism: Mechanism) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the places of our q and u in Pinocchio's order: depth-first, by names where joints part, w last."""
    bodies = mechanism.bodies
    carried: dict[int, list[int]] = {}
    for k, body in enumerate(bodies):
        carried.setdefault(body.parent, []).append(k)
    places_q, places_u, waiting = list[int](), list[int](), [-1]
    while waiting:
        k = waiting.pop()
        waiting += sorted(carried.get(k, ()), key=lambda child: bodies[child].joint_name, reverse=True)
        if k >= 0:
            own = list(bodies[k].q)
            for ball in bodies[k].quaternions:
                first = own.index(ball[0])
                own[first : first + 4] = [*ball[1:], ball[0]]
            places_q += own
            places_u += bodies[k].u
    return np.array(places_q, dtype=np.intp), np.array(places_u, dtype=np.intp)


def tool_function(
    name: str, program: Program, arguments: Sequence[str], free: Mapping[str, Sequence[int]], parameters: Floats
) -> ToolFunction:
    """Return a Program as a function of `arguments`, then of these places of its `inputs` and `parameters`.

    Other parameters have these values.
    """
    sizes = {array.name: array.size for array in program.inputs}
    third = program.inputs[2].name
    arrays = {each: third if k == 2 else each for k, each in enumerate(arguments)}
    taken = [Argument(each, array, tuple(range(sizes[array])), scalar=each == "t") for each, array in arrays.items()]
    taken += [Argument(each, each, tuple(places)) for each, places in free.items()]
    return ToolFunction(name, program, tuple(taken), {"parameters": tuple(parameters.tolist())})
