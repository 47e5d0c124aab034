"""Random systems of blocks on slopes and on each other, with ropes: as declared, and cut free by hand in numbers.

The second route knows nothing of the program: particles in the plane, rows of numbers, and all states tried in turn by
the rule for two coefficients (at rest first with the static one; what slips there gets the kinetic one).
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Any

import numpy as np

import multibody_sym as mbs

FLOOR = 1e-9
ROUNDED = 1e-12


@dataclass
class Contact:
    """Block `upper` on block `lower` (-1: the slope), at the angle of their slope."""

    name: str
    upper: int
    lower: int
    static: float
    kinetic: float
    speed: float = 0.0


@dataclass
class Rope:
    """A rope that pulls blocks up their slopes, or two neighbours together (`train`)."""

    name: str
    first: int
    second: int
    train: bool
    slack: bool


@dataclass
class World:
    """Blocks: masses, slopes (angles), applied forces in axes of their slopes; contacts and ropes."""

    gravity: float
    masses: list[float] = field(default_factory=list)
    angles: list[float] = field(default_factory=list)
    forces: list[tuple[float, float]] = field(default_factory=list)
    heights: list[int] = field(default_factory=list)
    lanes: list[int] = field(default_factory=list)
    places: list[float] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    ropes: list[Rope] = field(default_factory=list)


def random_world(seed: int) -> World:
    """Return 2 to 5 blocks on one or two slopes, single or stacked, some tied by ropes."""
    rng = random.Random(seed)
    world = World(rng.choice([9.81, 10.0]))
    spread = rng.choice([0.5, 3.0])
    lanes = [rng.uniform(-0.9, 0.9) for _ in range(rng.randint(1, 2))]
    tops: dict[int, list[int]] = {k: [] for k in range(len(lanes))}
    for i in range(rng.randint(2, 5)):
        lane = rng.randrange(len(lanes))
        stack = bool(tops[lane]) and rng.random() < 0.35
        below = tops[lane][-1] if stack else -1
        world.masses.append(10 ** rng.uniform(-spread, spread))
        world.angles.append(lanes[lane])
        size = world.masses[i] * world.gravity
        pushed = rng.random() < 0.5
        world.forces.append((rng.uniform(-1, 1) * size, rng.uniform(-0.5, 0.3) * size) if pushed else (0.0, 0.0))
        world.heights.append(world.heights[below] + 1 if stack else 0)
        world.places.append(world.places[below] if stack else -5.0 - len(tops[lane]))
        world.lanes.append(lane)
        world.speeds.append(0.0)
        static = rng.choice([0.0, 0.1, 0.3, 0.8])
        kinetic = static * rng.choice([1.0, 1.0, 0.7])
        world.contacts.append(Contact(f"c{i}", i, below, static, kinetic))
        tops[lane].append(i)
    _tie(world, tops, rng)
    return world


def _tie(world: World, tops: dict[int, list[int]], rng: random.Random) -> None:
    lows = {lane: [i for i in row if world.heights[i] == 0] for lane, row in tops.items()}
    for _lane, row in lows.items():
        for a, b in pairwise(row):
            if rng.random() < 0.5:
                world.ropes.append(Rope(f"train{a}{b}", a, b, True, True))
    if len(lows) == 2 and all(lows.values()) and rng.random() < 0.7:
        world.ropes.append(Rope("over", lows[0][0], lows[1][0], False, True))
    tied = {i for rope in world.ropes for i in (rope.first, rope.second)}
    for contact in world.contacts:
        alone = contact.upper not in tied and all(c.lower != contact.upper for c in world.contacts)
        if alone and rng.random() < 0.4:
            contact.speed = world.speeds[contact.upper] = rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 2.0)


def system_of(world: World) -> mbs.System:
    """Return the world as a user would declare it."""
    frames = {f"slope{k}": {"rotate": [{"axis": "z", "angle": world.angles[i]}]} for i, k in enumerate(world.lanes)}
    surfaces: dict[str, Any] = {
        f"face{k}": {"plane": [0, 0, 0], "normal": [-math.sin(a), math.cos(a), 0]}
        for k, a in zip(world.lanes, world.angles, strict=True)
    }
    points = {f"top{k}": [0, 0, 0] for k in world.lanes}
    bodies: dict[str, Any] = {"ground": mbs.Body(frames=frames, surfaces=surfaces, points=points)}
    joints, forces = {}, {}
    for i, mass in enumerate(world.masses):
        lane, height = world.lanes[i], 0.1 * world.heights[i]
        bodies[f"b{i}"] = mbs.Body(
            mass=mass, surfaces={"top": {"plane": [0, 0.1, 0], "normal": "y"}}
        )
        joints[f"j{i}"] = mbs.PointJoint(
            f"ground.slope{lane}", f"b{i}", initial={"q": [world.places[i], height], "u": [world.speeds[i], 0.0]}
        )
        c, s = math.cos(world.angles[i]), math.sin(world.angles[i])
        along, up = world.forces[i]
        forces[f"f{i}"] = mbs.Force(f"b{i}", [c * along - s * up, s * along + c * up, 0])
    contacts = {
        c.name: mbs.Contact(
            [f"b{c.upper}", f"b{c.lower}.top" if c.lower >= 0 else f"ground.face{world.lanes[c.upper]}"],
            static=c.static, kinetic=c.kinetic,
        )
        for c in world.contacts
    }
    pulleys = {f"p{k}": mbs.Pulley(f"ground.top{k}") for k in set(world.lanes)}
    constraints = {}
    for rope in world.ropes:
        over = [] if rope.train else [f"p{world.lanes[rope.first]}", f"p{world.lanes[rope.second]}"]
        if len(set(over)) == 2:
            over = over[:1]  # both tops are one place
        constraints[rope.name] = mbs.Rope([f"b{rope.first}", *over, f"b{rope.second}"], slack=rope.slack)
    return mbs.System(
        "random", gravity=[0, -world.gravity, 0], bodies=bodies, joints=joints, forces=forces, contacts=contacts,
        constraints=constraints, pulleys=pulleys,
    )


@dataclass
class Candidate:
    """One state that satisfies all inequalities: accelerations (n, 2) in axes of the slopes, forces by name."""

    words: tuple[str, ...]
    accelerations: Any
    normals: Any
    frictions: Any
    tensions: Any


def enumerate_states(world: World, coefficients: list[float]) -> list[Candidate]:
    """Return all consistent states at given coefficients, one for each contact."""
    words = [("open", "stick", "slide+", "slide-") if c.speed == 0.0 and mu > 0.0 else
             ("open", "slide+" if c.speed > 0 else "slide-") if c.speed != 0.0 else ("open", "slide+")
             for c, mu in zip(world.contacts, coefficients, strict=True)]
    ropes = [("taut", "slack") if rope.slack else ("taut",) for rope in world.ropes]
    found = []
    for chosen in product(*words, *ropes):
        candidate = _tried(world, coefficients, chosen)
        if candidate is not None:
            found.append(candidate)
    return found


def _rows(world: World) -> tuple[Any, Any, Any]:
    """Return rows (m, 2 n) of the accelerations: normal and tangent of each contact, shortening of each rope."""
    n = len(world.masses)
    normals, tangents = np.zeros((len(world.contacts), 2 * n)), np.zeros((len(world.contacts), 2 * n))
    for k, c in enumerate(world.contacts):
        normals[k, 2 * c.upper + 1] = tangents[k, 2 * c.upper] = 1.0
        if c.lower >= 0:
            normals[k, 2 * c.lower + 1] = tangents[k, 2 * c.lower] = -1.0
    ropes = np.zeros((len(world.ropes), 2 * n))
    for k, rope in enumerate(world.ropes):
        # phi = length - path; neighbours: the first stands farther up
        ropes[k, 2 * rope.first] = -1.0 if rope.train else 1.0
        ropes[k, 2 * rope.second] = 1.0
    return normals, tangents, ropes


def _tried(world: World, mus: list[float], chosen: tuple[str, ...]) -> Candidate | None:
    n, m = len(world.masses), len(world.contacts)
    normals, tangents, ropes = _rows(world)
    mass = np.repeat(world.masses, 2)
    applied = np.zeros(2 * n)
    for i in range(n):
        weight = world.masses[i] * world.gravity
        applied[2 * i] = world.forces[i][0] - weight * math.sin(world.angles[i])
        applied[2 * i + 1] = world.forces[i][1] - weight * math.cos(world.angles[i])
    rows, columns, kinds = [], [], []
    for k, word in enumerate(chosen[:m]):
        if word == "open":
            continue
        sign = {"slide+": 1.0, "slide-": -1.0, "stick": 0.0}[word]
        rows.append(normals[k])
        columns.append(normals[k] - sign * mus[k] * tangents[k])
        kinds.append(("n", k))
        if word == "stick":
            rows.append(tangents[k])
            columns.append(tangents[k])
            kinds.append(("t", k))
    for k, word in enumerate(chosen[m:]):
        if word == "taut":
            rows.append(ropes[k])
            columns.append(ropes[k])
            kinds.append(("r", k))
    size = len(rows)
    K = np.zeros((2 * n + size, 2 * n + size))
    K[: 2 * n, : 2 * n] = np.diag(mass)
    scale = np.sqrt(mass)
    if size:
        K[: 2 * n, 2 * n :] = -np.array(columns).T
        K[2 * n :, : 2 * n] = np.array(rows)
        K[: 2 * n, :] /= scale[:, None]
        K[:, : 2 * n] /= scale[None, :]
    else:
        K = np.diag(np.ones(2 * n))
    right = np.concatenate([applied / scale, np.zeros(size)])
    solution, *_ = np.linalg.lstsq(K, right, rcond=1e-13)
    if np.abs(K @ solution - right).max(initial=0.0) > 1e-8 * max(1e-300, np.abs(right).max()):
        return None
    a = solution[: 2 * n] / scale
    forces = dict(zip(kinds, solution[2 * n :], strict=True))
    return _judged(world, mus, chosen, a, forces)


def _judged(
    world: World, mus: list[float], chosen: tuple[str, ...], a: Any, forces: dict[Any, float]
) -> Candidate | None:
    m = len(world.contacts)
    normals, tangents, ropes = _rows(world)
    largest = max([1e-300, *map(abs, forces.values()), *(x * world.gravity for x in world.masses)])
    # Rounding of the largest force: a limit between forces has its own terms' besides. More would let a rope push
    # a gram beside a heavy block.
    eps_f, eps_a = ROUNDED * largest, FLOOR * max(1.0, np.abs(a).max())
    N, T, R = np.zeros(m), np.zeros(m), np.zeros(len(world.ropes))
    for k, word in enumerate(chosen[:m]):
        if word == "open":
            if normals[k] @ a < -eps_a:
                return None
            continue
        N[k] = forces["n", k]
        if N[k] < -eps_f:
            return None
        at = tangents[k] @ a
        if word == "stick":
            T[k] = forces["t", k]
            if abs(T[k]) > (1.0 + FLOOR) * mus[k] * N[k] + eps_f:
                return None
        else:
            sign = 1.0 if word == "slide+" else -1.0
            T[k] = -sign * mus[k] * N[k]
            if world.contacts[k].speed == 0.0 and mus[k] > 0.0 and sign * at < -eps_a:
                return None
    for k, word in enumerate(chosen[m:]):
        if word == "slack":
            if ropes[k] @ a < -eps_a:
                return None
        else:
            R[k] = forces["r", k]
            if world.ropes[k].slack and R[k] < -eps_f:
                return None
    return Candidate(chosen, a.reshape(-1, 2), N, T, R)


def the_state(world: World) -> list[Any]:
    """Return the distinct accelerations of the state(s) by the rule for two coefficients; [] where there is none."""
    static = [c.static if c.speed == 0.0 else c.kinetic for c in world.contacts]
    kinetic = [c.kinetic for c in world.contacts]
    slipping: set[int] = set()
    for _ in range(len(static) + 1):
        mus = [kinetic[k] if k in slipping else static[k] for k in range(len(static))]
        found = enumerate_states(world, mus)
        new = set(slipping)
        if found:
            tangents = _rows(world)[1]
            slips = np.abs(tangents @ found[0].accelerations.ravel()) > 1e-9 * world.gravity
            new |= {k for k, slip in enumerate(slips) if slip and found[0].words[k].startswith("slide")}
        if new == slipping:
            break
        slipping = new
    distinct: list[Candidate] = []
    for candidate in found:
        size = max(1.0, np.abs(candidate.accelerations).max())
        if all(np.abs(candidate.accelerations - d.accelerations).max() > 1e-7 * size for d in distinct):
            distinct.append(candidate)
    return distinct
