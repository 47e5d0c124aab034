"""Random model files: plane mechanisms with stops, ropes, contacts and friction, bodies on feet in space, loops.

`random_model` draws the content of a file from a seed. The ranges stand below. Each model has one or two parts of
`KINDS` with 1 to 6 bodies together; lengths have three digits, and places that must fit are expressions. The program
`random_runs` beside it gives them to commands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import yaml
from one_way_problems import random_blocks
from random_loops import closed

from multibody_sym.mechanics.model_files import dumps, yaml_text

MU: Final = (0, 0.1, 0.3, 0.7, 1.5)
"""Coefficients of friction."""
RESTITUTION: Final = (0, 0.5, 1)
BODIES: Final = (1, 6)
FEET: Final = (1, 8)
"""Points of a body that touch a plane in space."""
MASSES: Final = (0.1, 10.0)
LENGTHS: Final = (0.3, 1.2)
ENOUGH: Final = 0.1
"""How often friction at rest is `enough`."""
LOOPS: Final = 1 / 15
"""How often a model is a loop in space."""
MASSLESS: Final = 0.25
"""How often a link between others has no mass."""
GRAVITY: Final = 9.81

RUN: Final = {"outputs": {"E": "total_energy()"}, "simulation": {"t_end": 1, "samples": 101}}

Data = dict[str, Any]


@dataclass
class Drawn:
    """A model while it is drawn: the sections of its file, how many bodies may come, where the next part stands."""

    rng: np.random.Generator
    left: int
    space: bool = False
    place: float = 0.0
    data: Data = field(default_factory=dict)
    free: list[str] = field(default_factory=list)
    """Points of bodies that forces and springs may take."""

    def some(self, choices: Any) -> Any:
        return choices[int(self.rng.integers(len(choices)))]

    def chance(self, part: float) -> bool:
        return bool(self.rng.random() < part)

    def between(self, low: float, high: float) -> float:
        return round(float(self.rng.uniform(low, high)), 3)

    def whole(self, low: int, high: int) -> int:
        return int(self.rng.integers(low, high + 1))

    def length(self) -> float:
        return self.between(*LENGTHS)

    def mass(self) -> float:
        return float(f"{math.exp(self.rng.uniform(*np.log(MASSES))):.3g}")

    def friction(self) -> Data:
        """Return coefficients of friction, none where the contact is smooth."""
        if self.chance(ENOUGH):
            return {"static": "enough"}
        mu = self.some(MU)
        return {"static": mu, "kinetic": round(0.6 * mu, 3)} if self.chance(0.3) else {"static": mu}

    def touch(self, gap: float = 0.0) -> Data:
        """Return the laws of a contact, which is open where there is a gap."""
        return {**self.friction(), "restitution": self.some(RESTITUTION), **({"open": "true"} if gap else {})}

    def add(self, section: str, prefix: str, content: Data) -> str:
        """Put an element into a section under the next name with this prefix; return the name."""
        known = self.data.setdefault(section, {})
        number = 1 + sum(name.startswith(prefix) for name in known)
        known[f"{prefix}{number}"] = content
        return f"{prefix}{number}"

    def body(self, **content: Any) -> str:
        self.left -= 1
        return self.add("bodies", "b", content)

    def ground(self, section: str, prefix: str, content: Any) -> str:
        """Give ground a point, frame or surface; return its whole name."""
        parts = self.data.setdefault("bodies", {}).setdefault("ground", {}).setdefault(section, {})
        name = f"{prefix}{1 + sum(known.startswith(prefix) for known in parts)}"
        parts[name] = content
        return f"ground.{name}"

    def bar(self, length: float, *, massless: bool = False, **points: Any) -> str:
        """Add a bar from its body's origin along x, with its end as the point e."""
        mass = self.mass()
        ends = {"e": [length, 0, 0], "h": [round(length / 2, 4), 0, 0], **points}
        if massless:
            return self.body(mass=0, points=ends)
        return self.body(shape={"rod": length, "mass": mass}, points=ends)

    def course(self, amplitude: float, *, smooth: bool = False) -> Any:
        """Return a motion or force that starts from zero: an expression of t, or an input with a table of it.

        A motion must be `smooth`: where its rate jumps it is refused.
        """
        turn, size = self.between(1, 8), round(amplitude * self.between(0.3, 1), 4)
        if self.chance(0.5):
            return f"{size}*sin({turn}*t)"
        rows = [[round(0.25 * k, 2), round(size * math.sin(turn * 0.25 * k), 4)] for k in range(6)]
        kind = "cubic" if smooth else self.some(["linear", "cubic"])
        return self.add("inputs", "w", {"table": rows, "interpolation": kind})

    def pin(self, joint: str) -> None:
        """Make a hinge that has a coordinate rough on a journal, sometimes."""
        if not {"cut", "motion"} & set(self.data["joints"][joint]) and self.chance(0.5):
            rough = {"type": "friction", "joint": joint, **self.friction(), "radius": self.between(0.01, 0.05)}
            self.add("forces", "rub", rough)

    def stops(self, lower: float, upper: float) -> Data:
        """Return stops around a coordinate that starts between them, sometimes none."""
        if self.chance(0.5):
            return {}
        return {"limits": {"lower": lower, "upper": upper, "restitution": self.some(RESTITUTION)}}

    def floor(self, height: float = 0.0) -> str:
        return self.ground("surfaces", "floor", {"plane": [0, height, 0], "normal": "y"})

    def push(self, body: str, mass: float) -> None:
        """Push a body by a force of time, sometimes."""
        if self.chance(0.4):
            size = self.course(1.5 * mass * GRAVITY)
            value = [size, 0, 0] if self.chance(0.7) else [0, size, 0]
            self.add("forces", "push", {"type": "force", "on": body, "value": value})


def linkage(m: Drawn) -> None:
    """Add a four-bar linkage or a crank with a slider; its pins may be rough, its links without mass."""
    driven = m.chance(0.4)
    slider = m.chance(0.4)
    a, x = m.between(0.15, 0.3), m.place
    start = m.between(0.3, 2.8)
    tip = np.array([a * math.cos(start), a * math.sin(start)])
    o = m.ground("points", "o", [x, 0, 0])
    crank = m.bar(a, massless=driven and m.chance(MASSLESS))
    first = {"type": "revolute", "parent": o, "child": crank}
    if driven:
        speed = m.between(1, 9)
        first["motion"] = f"{start} + {speed}*t" if m.chance(0.7) else f"{start} + {m.course(0.5, smooth=True)}"
    else:
        first |= {"q": f"{crank}_q"}
        first["initial"] = {"q": start, "u": m.some([0, m.between(-5, 5)]), "known": "true"}
        first |= m.stops(round(start - m.between(0.1, 1), 3), round(start + m.between(0.1, 1), 3))
    pins = [m.add("joints", "j", first)]
    pins += _slider(m, o, crank, start, tip) if slider else _rocker(m, crank, start, tip, driven=driven)
    for pin in pins:
        m.pin(pin)


def _slider(m: Drawn, foot: str, crank: str, start: float, tip: np.ndarray) -> list[str]:
    """Add a rod from the crank's tip to a slider in a guide that may be rough; return its pins."""
    long = m.between(0.5, 0.9)
    angle = -math.asin(tip[1] / long)
    rod = m.bar(long, massless=m.chance(MASSLESS))
    block = m.body(mass=m.mass(), inertia={"Izz": 0.01})
    pins = [_joined(m, crank, rod, angle - start)]
    slide = {"type": "prismatic", "parent": foot, "child": block, "axis": "x", "q": f"{block}_s"}
    away = round(float(tip[0] + long * math.cos(angle)), 4)
    slide |= {"initial": {"q": away}, **m.stops(round(away - m.between(0.05, 0.3), 3), round(away + 0.4, 3))}
    guide = m.add("joints", "j", slide)
    pins.append(m.add("joints", "j", _cut(f"{rod}.e", block)))
    if m.chance(0.6):
        m.add("forces", "rub", {"type": "friction", "joint": guide, **m.friction()})
    m.push(block, 1)
    return pins


def _rocker(m: Drawn, crank: str, start: float, tip: np.ndarray, *, driven: bool) -> list[str]:
    """Add a coupler from the crank's tip to a rocker, and sometimes a spring; return their pins."""
    base, long, rocker = m.between(0.5, 0.8), m.between(0.6, 0.8), m.between(0.5, 0.7)
    gap = np.array([base, 0.0]) - tip
    d = float(np.hypot(*gap))
    turned = math.acos((d * d + long * long - rocker * rocker) / (2 * d * long))
    angle = math.atan2(gap[1], gap[0]) + turned
    end = tip + long * np.array([math.cos(angle), math.sin(angle)])
    other = m.ground("points", "o", [round(m.place + base, 4), 0, 0])
    coupler = m.bar(long, massless=m.chance(MASSLESS))
    arm = m.bar(rocker, massless=driven and m.chance(MASSLESS))
    pins = [_joined(m, crank, coupler, angle - start)]
    swing = {"type": "revolute", "parent": other, "child": arm, "q": f"{arm}_q"}
    swing["initial"] = {"q": round(math.atan2(end[1], end[0] - base), 4)}
    pins += [m.add("joints", "j", swing), m.add("joints", "j", _cut(f"{coupler}.e", f"{arm}.e"))]
    if m.chance(0.3):
        m.add("forces", "spring", {"type": "spring", "joint": pins[1], "stiffness": m.between(1, 20), "length": 1})
    return pins


def _joined(m: Drawn, parent: str, child: str, angle: float) -> str:
    joint = {"type": "revolute", "parent": f"{parent}.e", "child": child, "q": f"{child}_q"}
    return m.add("joints", "j", {**joint, "initial": {"q": round(float(angle), 4)}})


def _cut(parent: str, child: str) -> Data:
    return {"type": "revolute", "parent": parent, "child": child, "cut": "true"}


def pendulums(m: Drawn) -> None:
    """Add a chain of bars on hinges with stops and rough pins, whose end may strike a floor."""
    before, count, angle, height = m.ground("points", "o", [m.place, 0, 0]), min(m.left, m.whole(1, 4)), 0.0, 0.0
    for k in range(count):
        long = m.length()
        link = m.bar(long, massless=0 < k < count - 1 and m.chance(MASSLESS))
        q = m.between(-1.5, 0) if k == 0 else m.between(-0.8, 0.8)
        angle += q
        height = min(height, height + long * math.sin(angle))
        joint = {"type": "revolute", "parent": before, "child": link, "q": f"{link}_q"}
        joint["initial"] = {"q": q, "u": m.some([0, m.between(-4, 4)])}
        joint |= m.stops(round(q - m.between(0, 0.8), 3), round(q + m.between(0.1, 1), 3))
        m.pin(m.add("joints", "j", joint))
        before = f"{link}.e"
    if m.chance(0.5):
        gap = m.between(0.02, 0.5)
        m.add("contacts", "c", {"between": [before, m.floor(round(height - gap, 3))], **m.touch(gap)})
    m.free.append(before)
    m.push(before.split(".")[0], 1)


def blocks_on_slopes(m: Drawn) -> None:
    """Add blocks on a slope and on each other; a rope over a drum may lead from one to a load that hangs."""
    slope = m.some([0, 0.2, 0.5, 0.9])
    c, s = f"cos({slope})", f"sin({slope})"
    frame = m.ground("frames", "slope", {"position": [m.place, 0, 0], "rotate": [{"axis": "z", "angle": slope}]})
    normal = [f"-{s}", c, 0] if slope else [0, 1, 0]
    under = m.ground("surfaces", "face", {"plane": [m.place, 0, 0], "normal": normal})
    count = min(m.left, m.whole(1, 3))
    hangs = m.left > count and m.chance(0.6)
    for k in range(count):
        mass = m.mass()
        block = m.body(mass=mass, surfaces={"top": {"plane": [0, 0.1, 0], "normal": "y"}})
        start = {"q": [-1, round(0.1 * k, 3)], "u": [m.some([0, 0, m.between(-2, 2)]), 0]}
        joint = {"type": "point", "parent": frame, "child": block, "q": [f"{block}_x", f"{block}_y"], "initial": start}
        m.add("joints", "j", joint)
        m.add("contacts", "c", {"between": [block, under], **m.touch()})
        under = f"{block}.top"
        m.push(block, mass)
        m.free.append(block)
        if k == 0 and hangs:
            _over_a_drum(m, block, slope)


def _over_a_drum(m: Drawn, block: str, slope: float) -> None:
    """Lead a rope from a block up the slope over a drum of 0.1 m to a load that hangs."""
    c, s = math.cos(slope), math.sin(slope)
    centre = [round(m.place - 0.1 * s, 6), round(0.1 * c, 6), 0]
    post = m.ground("points", "post", [*(_moved(centre, 0.5 * c, 0.5 * s)), 0])
    beside = m.ground("points", "beside", [round(m.place + 0.1 - 0.1 * s + 0.5 * c, 6), -0.5, 0])
    load = m.body(mass=m.mass())
    m.add("joints", "j", {"type": "prismatic", "parent": beside, "child": load, "axis": "-y", "q": f"{load}_s"})
    rough = {"rough": m.some(MU[1:])} if m.chance(0.6) else {}
    drum = m.add("pulleys", "drum", {"at": post, "radius": 0.1, **rough})
    slack = {"slack": "true", "restitution": m.some(RESTITUTION)} if m.chance(0.5) else {}
    # A rope that starts taut starts with one speed on both sides, which the start of the blocks leaves to it.
    joint = next(j for j in m.data["joints"].values() if j["child"] == block)
    joint["initial"]["u"] = [0, 0]
    m.add("constraints", "rope", {"type": "rope", "path": [block, drum, load], **slack})
    m.add("stop", "arrives", f"distance({block}, {post}) < 0.2")
    m.add("stop", "arrives", f"distance({load}, {post}) < 0.2")


def _moved(place: list[float], dx: float, dy: float) -> list[float]:
    return [round(place[0] + dx, 6), round(place[1] + dy, 6)]


def capstan(m: Drawn) -> None:
    """Add two loads on a rope over a drum that stands still, or a wheel that turns with the rope; it may go slack."""
    radius = m.between(0.05, 0.3)
    x, turns = m.place, m.left >= 3 and m.chance(0.5)
    loads = []
    for side in (x, round(x + 2 * radius, 3)):
        mass = m.mass()
        load = m.body(mass=mass)
        at = m.ground("points", "line", [side, m.between(-1, -0.5), 0])
        joint = {"type": "prismatic", "parent": at, "child": load, "axis": "y", "q": f"{load}_y"}
        m.add("joints", "j", {**joint, **m.stops(m.between(-0.6, -0.1), m.between(0.1, 0.4))})
        m.add("stop", "arrives", f"position({load}, y) > -0.05")
        loads.append(load)
        m.push(load, mass)
    centre = m.ground("points", "post", [round(x + radius, 3), 0, 0])
    if turns:
        wheel = m.body(shape={"disc": radius, "mass": m.mass()})
        m.pin(m.add("joints", "j", {"type": "revolute", "parent": centre, "child": wheel, "q": f"{wheel}_q"}))
        drum = {"body": wheel, "radius": radius}
    else:
        drum = {"at": centre, "radius": radius}
    if m.chance(0.7):
        drum["rough"] = m.some(MU[1:])
    name = m.add("pulleys", "drum", drum)
    rope = {"type": "rope", "path": [loads[0], name, loads[1]]}
    if m.chance(0.5):
        rope |= {"slack": "true", "restitution": m.some(RESTITUTION)}
    m.add("constraints", "rope", rope)


def strings(m: Drawn) -> None:
    """Add particles on ropes that may go slack, from the ceiling and from each other."""
    before, y = m.ground("points", "o", [m.place, 0, 0]), 0.0
    for _ in range(min(m.left, m.whole(1, 3))):
        long = m.length()
        mass, over = m.mass(), m.between(0.3, 1) * long
        ball = m.body(mass=mass)
        y -= over
        start = {"q": [m.place, round(y, 4)], "u": [m.some([0, m.between(-3, 3)]), 0]}
        kind = {"type": "point", "parent": "ground", "child": ball, "q": [f"{ball}_x", f"{ball}_y"], "initial": start}
        m.add("joints", "j", kind)
        rope = {"type": "rope", "path": [before, ball], "length": long, "slack": "true"}
        m.add("constraints", "rope", {**rope, "restitution": m.some(RESTITUTION)})
        m.push(ball, mass)
        before = ball
    m.free.append(before)


def thrown(m: Drawn) -> None:
    """Add discs, boxes, bars and points that fall on a floor, against a wall and on each other."""
    floor = m.floor()
    wall = m.ground("surfaces", "wall", {"plane": [round(m.place - 0.8, 3), 0, 0], "normal": "x"})
    known: list[str] = []
    for k in range(min(m.left, m.whole(1, 3))):
        shape, mass = m.some(["disc", "disc", "box", "rod", "point"]), m.mass()
        rests = m.chance(0.35)
        x, turned = round(m.place + 1.3 * k, 3), 0.0 if rests else m.between(-1, 1)
        size = m.between(0.1, 0.4)
        if shape == "point":
            name, height = m.body(mass=mass), 0.0
        elif shape == "disc":
            name, height = m.body(shape={"disc": size, "mass": mass}), size
        elif shape == "box":
            high = m.between(0.1, 0.6)
            name, height = m.body(shape={"box": [size, high, 0.2], "mass": mass}), high / 2
        else:
            name, height = m.body(shape={"rod": size, "mass": mass}), 0.0
        gap = 0.0 if rests else round(m.between(0.05, 0.6) + (0.5 if shape != "point" else 0), 3)
        u = [m.between(-3, 3), 0.0 if rests else m.between(-3, 1)]
        if rests and m.chance(0.4):
            u[0] = 0.0
        start: Data = {"q": [x, round(height + gap, 4)], "u": u}
        joint: Data = {"type": "point", "q": [f"{name}_x", f"{name}_y"]}
        if shape != "point":
            joint = {"type": "planar", "q": [f"{name}_x", f"{name}_y", f"{name}_a"]}
            start = {"q": [*start["q"], turned], "u": [*u, 0.0 if rests else m.between(-5, 5)]}
        m.add("joints", "j", {**joint, "parent": "ground", "child": name, "initial": start})
        m.add("contacts", "c", {"between": [name, floor], **m.touch(gap)})
        if m.chance(0.4) and shape != "rod":
            m.add("contacts", "c", {"between": [name, wall], **m.touch(1)})
        if known and m.chance(0.6) and shape not in ("rod", "point"):
            m.add("contacts", "c", {"between": [name, known[-1]], **m.touch(1)})
        if shape in ("disc", "box"):
            known.append(name)
        m.push(name, mass)
        m.free.append(name)


def leaning(m: Drawn) -> None:
    """Add a bar that leans with both ends on floor and wall; it may carry a block in a guide along it."""
    long, angle, x = m.length(), m.between(0.3, 1.3), m.place
    bar = m.bar(long)
    floor, wall = m.floor(), m.ground("surfaces", "wall", {"plane": [x, 0, 0], "normal": "x"})
    q = [f"{bar}_x", f"{bar}_y", f"{bar}_a"]
    start = {"q": [f"{x} + {long}*cos({angle})", 0, f"pi - {angle}"]}
    m.add("joints", "j", {"type": "planar", "parent": "ground", "child": bar, "q": q, "initial": start})
    m.data["bodies"][bar]["points"]["f"] = [0, 0, 0]
    m.add("contacts", "c", {"between": [f"{bar}.f", floor], **m.touch()})
    m.add("contacts", "c", {"between": [f"{bar}.e", wall], **m.touch()})
    if m.left and m.chance(0.5):
        block = m.body(mass=m.mass(), inertia={"Izz": 0.01})
        joint = {"type": "prismatic", "parent": bar, "child": block, "axis": "x", "q": f"{block}_s"}
        joint |= {"initial": {"q": round(long / 2, 3)}, **m.stops(0.1, round(0.9 * long, 3))}
        rub = m.add("joints", "j", joint)
        m.add("forces", "rub", {"type": "friction", "joint": rub, **m.friction()})
    m.push(bar, 1)


def guided(m: Drawn) -> None:
    """Add sliders in rough guides with stops, which strike each other, and beads on wires."""
    x, before = m.place, None
    for k in range(min(m.left, m.whole(1, 3))):
        mass, at = m.mass(), m.ground("points", "o", [round(x, 3), 0, 0])
        if m.chance(0.25):
            bead, p = m.body(mass=mass), m.between(0.2, 1)
            curve = m.some([{"y": f"{p}*x^2"}, {"y": f"{p}*cos(3*x)"}])
            joint = {"type": "curve", "parent": at, "child": bead, "curve": curve, "q": f"{bead}_x"}
            start = {"q": m.between(-0.5, 0.5), "u": m.between(-2, 2)}
            rub = m.add("joints", "j", {**joint, "initial": start, **m.stops(-0.8, 0.8)})
            m.add("forces", "rub", {"type": "friction", "joint": rub, **m.friction()})
            before = None
        else:
            block = m.body(shape={"box": [0.2, 0.2, 0.2], "mass": mass}, points={"l": [-0.1, 0, 0]})
            joint = {"type": "prismatic", "parent": at, "child": block, "axis": "x", "q": f"{block}_s"}
            start = {"q": 0, "u": m.some([0, m.between(-3, 3)])}
            rub = m.add("joints", "j", {**joint, "initial": start, **m.stops(-m.between(0, 0.5), m.between(0, 0.9))})
            pads = {"length": m.between(0.05, 0.2)} if m.chance(0.3) else {}
            if m.chance(0.7):
                m.add("forces", "rub", {"type": "friction", "joint": rub, **m.friction(), **pads})
            if before:
                m.add("contacts", "c", {"between": [f"{block}.l", f"{before}.right"], **m.touch(1)})
            before = block
        if k and m.chance(0.4):
            names = list(m.data["bodies"])
            ends = [names[-2], names[-1]] if names[-2] != "ground" else ["ground", names[-1]]
            spring = {"type": "spring", "between": ends, "stiffness": m.between(5, 200), "length": 0.6}
            m.add("forces", "spring", spring)
        m.push(m.some([name for name in m.data["bodies"] if name != "ground"]), mass)
        x += m.between(0.4, 0.9)


def on_feet(m: Drawn) -> None:
    """Add bodies in space on a slope: on 1 to 8 feet, boxes and balls, at rest, sliding or falling."""
    tilt = m.some([0, 0, 0.2, 0.5])
    normal = [f"-sin({tilt})", 0, f"cos({tilt})"] if tilt else [0, 0, 1]
    floor = m.ground("surfaces", "floor", {"plane": [0, 0, 0], "normal": normal})
    frame = m.ground("frames", "slope", {"rotate": [{"axis": "y", "angle": -tilt}]}) if tilt else "ground"
    for k in range(min(m.left, m.whole(1, 2))):
        mass, high, rests = m.mass(), m.between(0.1, 0.4), m.chance(0.5)
        name, touching = _standing(m, mass, high)
        law = m.touch(0 if rests else 1)
        for place in touching:
            m.add("contacts", "c", {"between": [place, floor], **law})
        gap = 0.0 if rests else m.between(0.5, 0.8)
        speed = [m.between(-2, 2), m.between(-2, 2), 0] if m.chance(0.5) else [0, 0, 0]
        turning = [0, 0, m.between(-3, 3)] if rests else [m.between(-3, 3) for _ in range(3)]
        joint = {"type": "free", "parent": frame, "child": name}
        joint["initial"] = {"q": [1.5 * k, 0, round(high + gap, 4), 1, 0, 0, 0], "u": [*speed, *turning]}
        m.add("joints", "j", joint)
        m.push(name, mass)


def _standing(m: Drawn, mass: float, high: float) -> tuple[str, list[str]]:
    """Add a body whose centre is at a height above its lowest places; return it and the places that touch."""
    shape = m.some(["feet", "feet", "box", "ball"])
    if shape == "box":
        name = m.body(shape={"box": [m.between(0.2, 0.5), m.between(0.2, 0.5), 2 * high], "mass": mass})
        return name, [name]
    if shape == "ball":
        name = m.body(shape={"sphere": high, "mass": mass})
        return name, [name]
    count, wide = m.whole(*FEET), m.between(0.15, 0.4)
    feet = [(2 * math.pi * n / count, f"p{n + 1}") for n in range(count)]
    points = {foot: [round(wide * math.cos(a), 4), round(wide * math.sin(a), 4), -high] for a, foot in feet}
    inertia = {axis: round(mass * part, 5) for axis, part in (("Ixx", 0.02), ("Iyy", 0.03), ("Izz", 0.04))}
    name = m.body(mass=mass, inertia=inertia, points=points)
    return name, [f"{name}.{foot}" for foot in points]


def losing_mass(m: Drawn) -> None:
    """Add a cart or rocket whose mass varies, on a rough guide, between stops or above a floor."""
    mass, rate = m.mass(), m.between(0.1, 0.6)
    way = m.some(["x", "y"])
    blown = m.between(-60, 60)
    velocity = [blown, 0, 0] if way == "x" else [0, -abs(blown), 0]
    body = m.body(mass={"value": f"{mass}*(1 - {rate}*t)", "relative_velocity": velocity})
    at = m.ground("points", "o", [m.place, 0, 0])
    joint = {"type": "prismatic", "parent": at, "child": body, "axis": way, "q": f"{body}_s"}
    if way == "x":
        joint |= {"initial": {"q": 0, "u": m.between(-2, 2)}, **m.stops(-m.between(0.1, 0.5), m.between(0.1, 0.5))}
        rub = m.add("joints", "j", joint)
        m.add("forces", "rub", {"type": "friction", "joint": rub, **m.friction()})
    else:
        gap = m.some([0, m.between(0.1, 0.5)])
        joint["initial"] = {"q": gap, "u": 0 if not gap else m.between(-2, 2)}
        m.add("joints", "j", joint)
        m.add("contacts", "c", {"between": [body, m.floor()], **m.touch(gap)})
    if m.left and m.chance(0.5):
        other = m.body(mass=m.mass())
        end = m.ground("points", "o", [round(m.place + 1, 3), 0, 0])
        m.add("joints", "j", {"type": "prismatic", "parent": end, "child": other, "axis": way, "q": f"{other}_s"})
        spring = {"type": "spring", "between": [body, other], "stiffness": m.between(5, 100), "damping": 1, "length": 1}
        m.add("forces", "spring", spring)


def rows_of_blocks(m: Drawn) -> None:
    """Add particles under the rows of `random_blocks`: planes, ropes and guides, each from where it starts."""
    drawn = random_blocks(np.random.default_rng(int(m.rng.integers(2**32))))
    count = min(m.left, len(drawn.masses))
    names = []
    for k in range(count):
        mass = float(f"{min(max(drawn.masses[k], MASSES[0]), MASSES[1]):.3g}")
        name = m.body(mass=mass, surfaces={})
        names.append(name)
        place = {"q": [round(m.place + 0.8 * k, 3), round(0.3 * k, 3)]}
        kind = {"type": "point", "parent": "ground", "child": name, "q": [f"{name}_x", f"{name}_y"], "initial": place}
        m.add("joints", "j", kind)
        pulled = drawn.forces[k] + [0, GRAVITY * drawn.masses[k]]
        if np.any(pulled):
            size = min(1.0, 3 * mass * GRAVITY / float(np.hypot(*pulled)))
            value = [round(float(size * f), 3) for f in pulled] + [0]
            m.add("forces", "pull", {"type": "force", "on": name, "value": value})
    places = [m.data["joints"][f"j{k + 1 + len(m.data['joints']) - count}"]["initial"]["q"] for k in range(count)]
    for row in drawn.rows:
        pushed = [k for k in range(count) if np.any(row[2 * k : 2 * k + 2])]
        if len(pushed) == 1:
            k = pushed[0]
            way = row[2 * k : 2 * k + 2] / np.hypot(*row[2 * k : 2 * k + 2])
            plane = {"plane": [*places[k], 0], "normal": [round(float(w), 6) for w in way] + [0]}
            m.add("contacts", "c", {"between": [names[k], m.ground("surfaces", "face", plane)], **m.touch()})
        elif len(pushed) == 2:
            ends = [names[k] for k in pushed]
            rope = {"type": "rope", "path": ends, "slack": "true", "restitution": m.some(RESTITUTION)}
            m.add("constraints", "rope", rope)
    for name in names:
        del m.data["bodies"][name]["surfaces"]


KINDS: Final[Mapping[str, tuple[int, Callable[[Drawn], None]]]] = {
    "linkage": (3, linkage),
    "pendulums": (1, pendulums),
    "blocks_on_slopes": (1, blocks_on_slopes),
    "capstan": (2, capstan),
    "strings": (1, strings),
    "thrown": (1, thrown),
    "leaning": (1, leaning),
    "guided": (1, guided),
    "on_feet": (1, on_feet),
    "losing_mass": (1, losing_mass),
    "rows_of_blocks": (1, rows_of_blocks),
}
"""Kinds of parts: the least number of bodies that each takes, and what adds it."""


def random_model(seed: int) -> str:
    """Return a model file as text."""
    rng = np.random.default_rng([seed, 27])
    if rng.random() < LOOPS:
        return loop_in_space(rng, seed)
    m = Drawn(rng, int(rng.integers(BODIES[0], BODIES[1] + 1)))
    kinds = []
    for _ in range(m.whole(1, 2)):
        fitting = [kind for kind, (least, _add) in KINDS.items() if least <= m.left]
        fitting = [kind for kind in fitting if kind != "on_feet" or not kinds]
        if not fitting or kinds == ["on_feet"]:
            break
        kinds.append(m.some(fitting))
        KINDS[kinds[-1]][1](m)
        m.place += 4.0
    space = kinds == ["on_feet"]
    if len(m.free) >= 2 and m.chance(0.3):
        spring = {"type": "spring", "between": [m.free[0], m.free[-1]], "stiffness": m.between(1, 50), "damping": 0.5}
        m.add("forces", "spring", {**spring, "length": 3})
    if not space and m.chance(0.1):
        m.data["bodies"].setdefault("ground", {})["motion"] = {m.some("xy"): m.course(0.05, smooth=True)}
    head = {"multibody_sym": 1, "name": "_".join([*kinds, str(seed)])}
    gravity = {"gravity": [0, 0, -GRAVITY] if space else [0, -GRAVITY, 0]}
    _let_what_moves_slip(m.data)
    return yaml_text({**head, **gravity, **m.data, **RUN})


def _let_what_moves_slip(data: Data) -> None:
    """Give a coefficient in place of `enough` to what touches at the start, if anything moves there."""
    starts = [np.ravel(joint.get("initial", {}).get("u", 0)) for joint in data["joints"].values()]
    if any(np.any(start) for start in starts) or any("motion" in joint for joint in data["joints"].values()):
        for part in [*data.get("contacts", {}).values(), *data.get("forces", {}).values()]:
            if part.get("static") == "enough" and "open" not in part:
                part["static"] = MU[-1]


def loop_in_space(rng: np.random.Generator, seed: int) -> str:
    """Return a model file of a tree in space or in the plane that `random_loops` closes, with a rough pin."""
    while True:
        case, state = closed(int(rng.integers(10_000)), flat=bool(rng.random() < 0.3))
        data = yaml.load(dumps(case.system), Loader=yaml.BaseLoader)
        if len(data["bodies"]) <= BODIES[1] + 1 and not any("motion" in part for part in _elements(data)):
            break
    for joint in {coordinate.joint for coordinate in case.mechanism.coordinates}:
        q = [x for x, known in zip(state.q, case.mechanism.coordinates, strict=True) if known.joint == joint]
        u = [x for x, known in zip(state.u, case.mechanism.speeds, strict=True) if known.joint == joint]
        data["joints"][joint]["initial"] = {"q": q, "u": u}
    for name, joint in list(data["joints"].items()):
        if joint["type"] == "revolute" and rng.random() < 0.3:
            rough = {"type": "friction", "joint": name, "static": MU[int(rng.integers(len(MU)))], "radius": 0.02}
            data.setdefault("forces", {})[f"rub_{name}"] = rough
    return yaml_text({**data, "name": f"loop_{seed}", **RUN})


def _elements(data: Data) -> list[Any]:
    return [part for section in ("bodies", "joints", "constraints") for part in data.get(section, {}).values()]
