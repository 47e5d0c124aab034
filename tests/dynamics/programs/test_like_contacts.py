"""Programs of contacts that are derived by kinds against those of each mode alone, derived row by row, in runs."""

from __future__ import annotations

from itertools import combinations

import pytest
from test_every_mode import assert_alike

import multibody_sym as mbs
from multibody_sym.dynamics.programs.law_programs import row_program
from multibody_sym.mechanics.modes import every_row
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.motion.prepare.settings import Settings
from multibody_sym.motion.switching.law_mechanism import LawMechanism

LAW = "static: mu, kinetic: 0.3"


def pairs(names: list[str], surface: str) -> str:
    each = combinations(names, 2)
    return "".join(f"  c_{a}_{b}: {{between: [{a}.{surface}, {b}.{surface}], {LAW}}}\n" for a, b in each)


def discs(count: int = 5) -> str:
    """Discs of unequal sizes, with centres of mass off their middles, over a cart that rolls, between walls."""
    names = [f"b{k}" for k in range(count)]
    bodies = "".join(
        f"  {name}: {{mass: {1 + k}, com: [{0.02 * k}, 0.01, 0], inertia: {{Izz: 0.02}},"
        f" surfaces: {{rim: {{disc: {0.2 + 0.02 * k}}}}}}}\n"
        for k, name in enumerate(names)
    )
    joints = "".join(
        f"  j{k}: {{type: planar, parent: ground, child: b{k}, initial: {{q: [{-1.4 + 0.7 * k}, {0.3 + 0.02 * k}, 0],"
        f" u: [{0.9 - 0.5 * k}, 0, {k}]}}}}\n"
        for k in range(count)
    )
    walls = "".join(
        f"  c{k}_{wall}: {{between: [b{k}.rim, {wall}], {LAW}}}\n"
        for k in range(count)
        for wall in ("ground.left", "ground.right", "cart.floor")
    )
    return f"""
multibody_sym: 1
name: discs
gravity: [0, -9.81, 0]
parameters: {{mu: 0.4}}
bodies:
  ground: {{surfaces: {{left: {{plane: [-2, 0, 0], normal: x}}, right: {{plane: [2, 0, 0], normal: -x}}}}}}
  cart: {{mass: 5, surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
{bodies}joints:
  jc: {{type: prismatic, parent: ground, child: cart, axis: x, q: s}}
{joints}contacts:
{walls}{pairs(names, "rim")}"""


def balls(count: int = 4) -> str:
    """Balls in space on a floor, each the second of two links, the first with two degrees of freedom."""
    bodies = "".join(
        f"  a{k}: {{mass: 1, com: [0.1, 0, 0.2], inertia: {{Ixx: 0.1, Iyy: 0.2, Izz: 0.15}}}}\n"
        f"  b{k}: {{mass: {1 + k}, inertia: {{Ixx: 0.1, Iyy: 0.2, Izz: 0.1}},"
        f" surfaces: {{ball: {{sphere: {0.2 + 0.02 * k}, centre: [0.1, {0.05 + 0.05 * k}, -0.5]}}}}}}\n"
        for k in range(count)
    )
    joints = "".join(
        f"  i{k}: {{type: universal, parent: ground.p{k}, child: a{k}, initial: {{u: [0.1, {2 if k % 2 else -2}]}}}}\n"
        f"  j{k}: {{type: spherical, parent: a{k}, child: b{k}, initial: {{u: [0.2, {k}, 1]}}}}\n"
        for k in range(count)
    )
    floors = "".join(f"  c{k}: {{between: [b{k}.ball, ground.floor], {LAW}}}\n" for k in range(count))
    points = ", ".join(f"p{k}: [{0.12 + 0.6 * k}, 0, 0]" for k in range(count))
    return f"""
multibody_sym: 1
name: balls
gravity: [0, 0, -9.81]
parameters: {{mu: 0.4}}
bodies:
  ground: {{points: {{{points}}}, surfaces: {{floor: {{plane: [0, 0, -0.77], normal: z}}}}}}
{bodies}joints:
{joints}contacts:
{floors}{pairs([f"b{k}" for k in range(count)], "ball")}"""


def crates(count: int = 4) -> str:
    """Crates that slide over a table with ends, and past these."""
    bodies = "".join(f"  b{k}: {{shape: {{box: [0.3, {0.2 + 0.1 * k}, 0.1], mass: {1 + k}}}}}\n" for k in range(count))
    joints = "".join(
        f"  j{k}: {{type: planar, parent: ground, child: b{k}, initial: {{q: [{-1.2 + 0.8 * k}, {0.1 + 0.05 * k}, 0],"
        f" u: [{1 + k}, 0, 0]}}}}\n"
        for k in range(count)
    )
    contacts = "".join(f"  c{k}: {{between: [b{k}, ground.table], {LAW}}}\n" for k in range(count))
    return f"""
multibody_sym: 1
name: crates
gravity: [0, -9.81, 0]
parameters: {{mu: 0.4}}
bodies:
  ground: {{surfaces: {{table: {{plane: [-2, 0, 0], normal: y, between: [[-2, 0, 0], [1.5, 0, 0]]}}}}}}
{bodies}joints:
{joints}contacts:
{contacts}"""


def plates(count: int = 3) -> str:
    """Plates in space on four feet each, which share their weight: the first rests, others slide and turn."""
    feet = {"a": (0.3, 0.2), "b": (-0.3, 0.2), "c": (0.3, -0.2), "d": (-0.3, -0.2)}
    points = ", ".join(f"{name}: [{x}, {y}, -0.15]" for name, (x, y) in feet.items())
    bodies = "".join(
        f"  b{k}: {{shape: {{box: [0.6, 0.4, 0.3], mass: {1 + k}}}, points: {{{points}}}}}\n" for k in range(count)
    )
    joints = "".join(
        f"  j{k}: {{type: free, parent: ground, child: b{k}, initial: {{q: [0, {2 * k}, 0.15, 1, 0, 0, 0],"
        f" u: [{0.8 * k}, 0, 0, 0, 0, {k}]}}}}\n"
        for k in range(count)
    )
    contacts = "".join(
        f"  c{k}{name}: {{between: [b{k}.{name}, ground.floor], {LAW}}}\n" for k in range(count) for name in feet
    )
    return f"""
multibody_sym: 1
name: plates
gravity: [1, 0, -9.81]
parameters: {{mu: 0.4}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: z}}}}}}
{bodies}joints:
{joints}contacts:
{contacts}"""


@pytest.mark.parametrize(
    ("text", "until", "modes"),
    [(discs(), 0.4, 10), (balls(), 1.0, 2), (crates(), 0.3, 3), (plates(), 0.05, 1)],
    ids=["discs", "balls", "crates", "plates that share their weight"],
)
def test_modes_of_a_run_are_those_of_each_alone(text: str, until: float, modes: int) -> None:
    declared = LawMechanism.of(mechanism(mbs.loads(text)), Settings()).declared
    found = row_program(declared).contacts
    assert len(found.chosen) >= 4 * len(found.kinds) > 0
    assert assert_alike(text, until) >= modes


def test_one_set_of_programs_serves_however_many_contacts_of_few_kinds() -> None:
    """Each mode of more than 256 rows had Programs of its own."""
    declared = mechanism(mbs.loads(discs(16)))
    assert len(every_row(declared)) > 300
    assert LawMechanism.of(declared, Settings()).every is not None
