"""Ordinary model files with some of their values swept: 0, -1, very large and very small ones, and makers of nan."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from multibody_sym.text.yaml_tree import read_text

PARAMETERS: Final = {"zero_": 0, "one_": 1, "huge_": 1e300, "tiny_": 1e-300}
PLAIN: Final = (0, -1, 1e300, -1e300, 1e-300)
MAKERS: Final = (
    "1/zero_", "-1/zero_", "log(zero_)", "log(-one_)", "sqrt(-one_)", "huge_^2", "huge_*huge_ - huge_*huge_",
    "exp(huge_)", "asin(2*one_)", "zero_^(-one_)", "(-one_)^(one_/3)", "1/tiny_^2", "zero_/zero_", "huge_*t", "log(t)",
    "1/t", "sqrt(t - 1)", "1/(t - 0.05)", "tan(huge_)", "abs(zero_)/zero_", "atan2(zero_, zero_)",
)
_WORDS: Final = {
    *("type", "parent", "child", "axis", "q", "name", "axes", "angles", "joint", "on", "at", "between", "of", "frame"),
    *("body", "method", "coordinates", "path", "point", "through", "direction", "normal", "freedom", "multipliers"),
    *("multibody_sym", "label", "known", "cut", "projection", "repeat", "index_2", "start", "body_name", "joint_name"),
    *("translate", "rotate", "project"),
}

BASES: Final = {
    "springs": """
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {a: [0, 1, 0]}}
  block: {mass: 2, com: [0.1, 0.2, 0], inertia: {Izz: 0.3}, points: {p: [0.5, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: block, q: [x, y, th], initial: {q: [0.1, 0.2, 0.3], u: [1, 0, 0]}}}
forces:
  s: {type: spring_damper, between: [ground.a, block.p], stiffness: 100, damping: 2, length: 0.3}
  d: {type: drag, on: block, linear: 0.1, quadratic: 0.2}
  f: {type: force, on: block, at: p, value: [1, 2, 0]}
  p: {type: pull, between: [ground, block.p], value: 3*distance - distance_rate}
inputs: {w: 2*t}
outputs: {e: total_energy(), h: 'position(block.p, x)/2', r: 'reaction(j, fx)'}
stop: {far: x > 3}
ask: {v: 'velocity(block, y)', when: {x: 0.15}}
simulation: {t_end: 0.2, samples: 5}
""",
    "space": """
gravity: [0, 0, -9.81]
bodies:
  a: {mass: 1, com: [0, 0, 0.2], inertia: {Ixx: 0.2, Iyy: 0.3, Izz: 0.4, Ixy: 0.01}, points: {p: [0.1, 0.2, 0.3]}}
  b: {shape: {box: [0.1, 0.2, 0.3], mass: 2}, frames: {f: {position: [0, 0, 0.1], rotate: [{axis: x, angle: 0.2}]}}}
joints:
  j: {type: spherical, parent: ground, child: a, initial: {q: [1, 0.1, 0.2, 0.3], u: [0.1, 0.2, 3]}}
  k: {type: screw, parent: a.p, child: b.f, axis: [0, 1, 0.2], pitch: 0.05, q: s, limits: {lower: -1, upper: 2},
      initial: {q: 0.1, u: 0.5}}
forces:
  t: {type: torque, joint: k, value: 0.1*sin(t)}
  m: {type: motor, joint: k, voltage: 12, resistance: 2, constant: 0.05, gear: 3}
simulation: {t_end: 0.1, samples: 4, rtol: 1e-6}
""",
    "ropes": """
gravity: [0, -9.81, 0]
bodies: {ground: {points: {o: [0, 3, 0]}}, a: {mass: 1}, b: {mass: 2}, w: {mass: 0.5, inertia: {Izz: 0.1}}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: y1, initial: {q: 0.5}}
  B: {type: prismatic, parent: ground, child: b, axis: [0.2, 1, 0], q: y2, initial: {q: 0.4, u: 0}}
  W: {type: revolute, parent: ground.o, child: w, q: phi}
pulleys: {P: {at: ground.o, radius: 0.1}}
constraints:
  r: {type: rope, path: [a, P, b]}
  e: {type: coupler, joints: {W: 2, A: 1}, value: 0.5}
outputs: {T: tension(r)}
simulation: {t_end: 0.1, samples: 3, constraints: {baumgarte: {alpha: 10, beta: 10}}}
""",
    "rolling": """
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: [0.1, 1, 0]}}}
  wheel: {mass: 2, inertia: {Izz: 0.04}, surfaces: {rim: {disc: 0.2, axis: z}}}
joints: {j: {type: planar, parent: ground, child: wheel, q: [x, y, th], initial: {q: [0, 0.200998, 0], u: [1, 0, 0]}}}
constraints: {roll: {type: rolling, body: wheel.rim, on: ground.floor}}
simulation: {t_end: 0.1, samples: 3, project: true}
""",
    "gears": """
bodies: {a: {shape: {disc: 0.1, mass: 1}}, b: {shape: {cylinder: [0.2, 0.3], mass: 2}}, c: {mass: 1, com: [0.3, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: a, q: p, initial: {q: 0.1, u: 2}}
  B: {type: revolute, parent: ground, child: b, q: s}
  C: {type: prismatic, parent: b, child: c, axis: x, motion: 0.1*sin(3*t)}
constraints: {mesh: {type: gear, joints: [A, B], ratio: -2, value: 0.1}}
forces: {k: {type: spring_damper, joint: A, stiffness: 5, damping: 0.1, length: 0.2}}
simulation: {t_end: 0.1, samples: 3}
""",
    "guides": """
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {o: [0, 0, 0]}, motion: {x: 0.1*sin(2*t)}}
  a: {mass: 1, points: {p: [0.2, 0, 0]}, inertia: {Izz: 0.02}}
  b: {shape: {rod: 0.5, mass: 1}, points: {e: [0.5, 0, 0]}}
joints:
  A: {type: planar, parent: ground, child: a, q: [x, y, th], initial: {q: [0.1, 0.3, 0.2]}}
  B: {type: revolute, parent: a.p, child: b, q: be, initial: {q: -0.5}}
constraints:
  l: {type: point_on_line, point: b.e, line: {through: ground.o, direction: [1, 0.2, 0]}}
  v: {type: velocity, zero: u_x - 0.5*u_y}
  d: {type: distance, between: [ground.o, a.p], value: 0.45}
simulation: {t_end: 0.1, samples: 3}
""",
}
"""Small models that together declare every kind of number, beside the examples."""


def bases(examples: Path) -> dict[str, dict[str, Any]]:
    """Return the trees of the models to sweep, by name."""
    made = {name: {"multibody_sym": 1, "name": name, **_tree(content)} for name, content in BASES.items()}
    for file in sorted(examples.glob("*.yaml")):
        made[file.stem] = _tree(file.read_text())
    return made


def _tree(content: str) -> Any:
    return read_text(content, "a model").data


def numbers(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths of everything in a model's tree that is a number or an expression."""
    if isinstance(tree, (dict, list)):
        for key, part in tree.items() if isinstance(tree, dict) else enumerate(tree):
            listed = key == "joints" and isinstance(part, list)
            if key not in _WORDS and not listed:
                yield from numbers(part, (*path, key))
    elif tree not in ("true", "false", ""):
        yield path


def swept(rng: random.Random, tree: dict[str, Any]) -> dict[str, Any]:
    """Return a model's tree with one to three of its numbers replaced."""
    changed = copy.deepcopy(tree)
    places = list(numbers(tree))
    for path in rng.sample(places, min(len(places), rng.choice((1, 1, 1, 2, 3)))):
        part: Any = changed
        for step in path[:-1]:
            part = part[step]
        part[path[-1]] = rng.choice((rng.choice(PLAIN), rng.choice(MAKERS)))
    if rng.random() < 0.15 and tree.get("parameters"):
        changed["gravity"] = [0, rng.choice((1e200, -1e200, "1/zero_")), 0]
    written = text_of(changed)
    used = {name: value for name, value in PARAMETERS.items() if name in written}
    if used:
        changed["parameters"] = {**(changed.get("parameters") or {}), **used}
    return changed


def words(rng: random.Random, file: str) -> list[str]:
    """Return a command for a file."""
    run = ["--t-end", "0.05", "--samples", "3", "--backend", "python"]
    return rng.choice((
        ["check", file], ["solve", file], ["simulate", file, *run], ["linearize", file],
        ["modes", file], ["equilibrium", file], ["derive", file], ["check", file],
        ["solve", file], ["simulate", file, *run],
    ))


def text_of(tree: dict[str, Any]) -> str:
    """Return a model's tree as a file holds it, on several lines, so that places have lines."""
    return json.dumps(tree, indent=1)
