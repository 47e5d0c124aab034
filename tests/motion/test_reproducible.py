"""The same model gives the same C, byte for byte: under every hash seed, and whatever its names are."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.model_files import loads
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program.c_target import c_source

MODEL = """
multibody_sym: 1
name: <system>
gravity: [0, -<g>, 0]
parameters: {<g>: 9.81, <m>: {value: 2, positive: true}, <l>: <m>/4, <k>: 30}
bodies:
  <arm>: {mass: <m>, com: [<l>/2, 0, 0], inertia: {Ixx: 0.1, Iyy: 0.2, Izz: <m>*<l>^2/12}, points: {<tip>: [<l>, 0, 0]}}
  <ball>: {shape: {sphere: 0.2, mass: <m>}, points: {<eye>: [0, 0.2, 0.1]}}
  <block>: {mass: 3}
  ground: {points: {<hook>: [1, 2, 0], <wall>: [0, 3, 1]}}
joints:
  <A>: {type: revolute, parent: ground, child: <arm>, axis: z, q: <phi>, initial: {q: 30 deg, u: 1}}
  <B>: {type: spherical, parent: <arm>.<tip>, child: <ball>}
  <C>: {type: prismatic, parent: ground, child: <block>, axis: [1, 2, 2], q: <s>}
pulleys: {<wheel>: {at: ground.<hook>, radius: 0.1}}
constraints:
  <rope>: {type: rope, path: [<arm>.<tip>, <wheel>, <block>]}
  <tie>: {type: expression, zero: <s> - 0.1*sin(<phi>) + 0.05}
forces:
  <spring>: {type: spring_damper, between: [<ball>.<eye>, ground.<wall>], stiffness: <k>, damping: <k>/10, length: <l>}
  <drive>: {type: torque, joint: <A>, value: <push>*cos(<phi>) - 0.1*u_<phi>}
inputs: {<push>: <k>*sin(3*t)}
outputs: {<out>: "tension(<rope>)*position(<ball>.<eye>, x)"}
"""
WORDS = re.findall(r"<(\w+)>", MODEL)
HASHES = """
import hashlib, sys
from multibody_sym.program.c_target import c_source
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.model_files import loads
from multibody_sym.mechanics.resolve import mechanism
text = sys.stdin.read()
for name in sys.argv[1:]:
    made = programs(mechanism(loads(text, "model")), FORMALISMS[name])
    for file, source in sorted(c_source(made.as_mapping()).items()):
        print(name, file, hashlib.sha256(source.encode()).hexdigest())
"""


def model(names: dict[str, str]) -> str:
    return re.sub(r"<(\w+)>", lambda match: names[match[1]], MODEL)


def sources(text: str, formalism: str) -> dict[str, str]:
    made = programs(mechanism(loads(text, "model")), FORMALISMS[formalism])
    return c_source(made.as_mapping())


OWN = {word: word for word in WORDS}
OTHER = {word: f"{'zqdxEINS'[k % 8]}{k}" for k, word in enumerate(WORDS)}
BACKWARD = {word: f"n{len(WORDS) - k:03}" for k, word in enumerate(WORDS)}


@pytest.mark.parametrize("formalism", [name for name in FORMALISMS if name != "lagrange"])  # which has no rows
@pytest.mark.parametrize("names", [OTHER, BACKWARD], ids=["other names", "names in reverse order"])
def test_names_leave_no_trace(names: dict[str, str], formalism: str) -> None:
    assert sources(model(OWN), formalism) == sources(model(names), formalism)


def printed(seed: int, *formalisms: str) -> str:
    """Return the hashes of the sources that a new process prints under a hash seed."""
    environment = {**os.environ, "PYTHONHASHSEED": str(seed)}
    command = [sys.executable, "-c", HASHES, *formalisms]
    done = subprocess.run(command, input=model(OWN), env=environment, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.parametrize("seeds", [range(4), pytest.param(range(32), marks=pytest.mark.long)], ids=["few", "many"])
def test_hash_seeds_leave_no_trace(seeds: range) -> None:
    assert len({printed(seed, "composite_body", "block_ldl") for seed in seeds}) == 1


def test_hash_seeds_leave_no_trace_in_what_sympy_derived() -> None:
    assert len({printed(seed, "multipliers") for seed in (0, 1, 7)}) == 1
