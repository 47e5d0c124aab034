"""The chain of eleven_rods.yaml struck at any of its rods, from either side, and on through its first self-contact.

    python struck_chain.py --rod 3 --side inside --turn pi/11
    python struck_chain.py --all

The first prints what the impact does to each rod and hinge, and the row of that chain; the second the row of each. Both
end with the largest misses of all their rows: from before the first impact to well after the second, how far momentum,
angular momentum and energy are from what they were, beside the sum of the sizes of their terms.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import multibody_sym as mbs

RODS = range(1, 12)
SIDES = {"outside": 1, "inside": -1}
LONGEST, SAMPLES = 60.0, 6001
"""For how long a chain is followed until it meets itself, in s, and at how many times it is looked at."""
TOGETHER = 1e-9
"""How exactly ends meet that meet each other, by symmetry, in m."""
KEPT = "momentum", "angular momentum", "energy"
HEAD = (
    "| rod | side | turn | impulse N*s | apparent mass kg | meets itself at s | with | impulse N*s | "
    "momentum | angular momentum | energy |\n|---|---|---|---|---|---|---|---|---|---|---|"
)


def rod(surface: mbs.Surface | None = None) -> mbs.Body:
    """A rod of the chain, from its hinge at [0, 0, 0] along x."""
    points = {"tip": [0, 0, 0], "middle": ["l/2", 0, 0], "end": ["l", 0, 0]}
    surfaces = {} if surface is None else {"side": surface}
    return mbs.Body(mass="m", com=["l/2", 0, 0], inertia={"Izz": "m*l^2/12"}, points=points, surfaces=surfaces)


def chain(struck: int, side: str, turn: str) -> mbs.System:
    """A particle at the middle of the struck rod, on its convex (outside) or its concave side."""
    n = f"{SIDES[side]}*cos(a)", f"{SIDES[side]}*sin(a)"
    first = ["R*cos(b) - l*cos(5*turn)/2", "R*sin(b) - l*sin(5*turn)/2", "5*turn"]
    flight = {"q": ["R*cos(a)", "R*sin(a)"], "u": [f"-v*{n[0]}", f"-v*{n[1]}"]}
    hinges = {
        f"hinge{k}": mbs.Revolute(f"rod{k}.end", f"rod{k + 1}", axis="z", q=f"phi{k + 1}", initial={"q": "-turn"})
        for k in RODS[:-1]
    }
    return mbs.System(
        "struck_chain",
        gravity=[0, 0, 0],
        parameters={
            "m": "1 kg", "l": "1 m", "v": "1 m/s", "turn": turn, "R": "l/(2*tan(turn/2))", "b": "pi/2 + 5*turn",
            "a": f"pi/2 + {6 - struck}*turn",
        },
        bodies={"particle": mbs.Body(mass="m"), **{f"rod{k}": rod() for k in RODS}},
        joints={
            "flight": mbs.PointJoint("ground", "particle", q=["x", "y"], initial=flight),
            "table": mbs.Planar("ground", "rod1", q=["x1", "y1", "phi1"], initial={"q": first}),
            **hinges,
        },
        impact=mbs.Impact(between=["particle", f"rod{struck}.middle"], normal=[*n, 0], restitution=1),
        simulation=mbs.Settings(t_end=LONGEST, rtol=1e-13, atol=1e-14),
    )  # fmt: skip


Terms = Any
"""Terms of a sum by bodies, components and times: (k, d, n)."""


@dataclass(frozen=True)
class Motion:
    """Times (n,), hinges and ends (12, 2, n), rods' directions (11, 2, n), angular velocities (11, n), centres' speeds.

    `particle` (2, 2, n): its place and its velocity.
    """

    t: Any
    corners: Any
    along: Any
    turning: Any
    speeds: Any
    particle: Any

    @staticmethod
    def of(run: mbs.Trajectory) -> Motion:
        """The motion of a run."""
        phi, turning = (np.cumsum([run[f"{u}phi{k}"] for k in RODS], axis=0) for u in ("", "u_"))
        along = np.stack([np.cos(phi), np.sin(phi)], axis=1)
        across = np.stack([-np.sin(phi), np.cos(phi)], axis=1) * turning[:, None]
        start, rate = (np.array([[run[f"{u}x1"], run[f"{u}y1"]]]) for u in ("", "u_"))
        corners, rates = (np.cumsum(np.concatenate(pair), axis=0) for pair in ((start, along), (rate, across)))
        particle = np.array([[run["x"], run["y"]], [run["u_x"], run["u_y"]]])
        return Motion(run.t, corners, along, turning, (rates[1:] + rates[:-1]) / 2, particle)

    def until(self, count: int) -> Motion:
        """The first samples."""
        return Motion(*(x[..., :count] for x in vars(self).values()))

    def before(self, side: str) -> Motion:
        """The first sample as it was before the impact: all rods rest, and the particle comes with 1 m/s."""
        first = self.until(1)
        place = first.particle[0]
        flying = np.stack([place, -SIDES[side] * place / np.hypot(*place)])
        return replace(first, turning=0 * first.turning, speeds=0 * first.speeds, particle=flying)

    def kept(self) -> tuple[Terms, Terms, Terms]:
        """Terms (.., n) of momentum, of angular momentum about the origin and of energy; all masses are 1 kg."""
        centres = (self.corners[1:] + self.corners[:-1]) / 2
        places, speeds = np.concatenate([centres, self.particle[:1]]), np.concatenate([self.speeds, self.particle[1:]])
        moments = np.concatenate([cross(places, speeds), self.turning / 12])
        energies = np.concatenate([(speeds**2).sum(axis=1) / 2, self.turning**2 / 24])
        return speeds, moments[:, None], energies[:, None]


def cross(a: Any, b: Any) -> Any:
    """The product a_x b_y - a_y b_x of vectors along the second axis."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def named(corner: int) -> str:
    """The name of a hinge or end."""
    return f"rod{corner}.end" if corner else "rod1.tip"


def meetings(motion: Motion) -> Iterator[tuple[float, int, int, int]]:
    """Yield when (in samples) a corner, from which side, passes through which rod."""
    for k in RODS:
        for corner in (c for c in range(12) if c not in (k - 1, k)):
            arm, along = motion.corners[corner] - motion.corners[k - 1], motion.along[k - 1]
            place, height = (arm * along).sum(axis=0), along[0] * arm[1] - along[1] * arm[0]
            near = (place[1:] >= -1e-6) & (place[1:] <= 1 + 1e-6)
            for n in np.nonzero((height[1:] * height[:-1] < 0) & near)[0][:1]:
                yield n + height[n] / (height[n] - height[n + 1]), corner, int(np.sign(height[n])), k


@dataclass(frozen=True)
class Meeting:
    """When (s) which corner first meets what, and with which impulse (N s)."""

    t: float
    corner: str
    other: str
    impulse: float


def met(system: mbs.System) -> tuple[Sequence[Motion], Meeting]:
    """Return the motion until shortly before the chain meets itself and that through it, and what meets.

    Which of the 110 corners and sides meet is not known before: a run without contacts tells.
    """
    flight = mbs.simulate(system, samples=SAMPLES)
    free = Motion.of(flight)
    passed, corner, side, k = min(meetings(free), key=lambda each: (round(each[0], 6), *each[1:]))
    sample = int(passed)
    point, end = named(corner), end_met(free, sample, corner, k)
    surface = mbs.Surface(segment=[[0, 0, 0], [1, 0, 0]], normal=[0, side, 0])
    closing = replace(
        system,
        bodies={**system.bodies, f"rod{k}": rod(surface)},
        contacts={"meet": mbs.Contact([point, end or f"rod{k}.side"], restitution=1, open=True)},
        impact=None,
    )
    state = {name: float(flight[name][sample]) for name in (*flight.coordinates, *flight.speeds)}
    begun = float(flight.t[sample])
    run = mbs.simulate(closing, t_end=0.1 * begun, samples=301, initial=state)
    event = next(event for event in run.events if event["kind"] == "impact")
    meeting = Meeting(begun + event["t"], point, end or f"rod{k}", event["impulse"])
    return (free.until(sample + 1), Motion.of(run)), meeting


def end_met(motion: Motion, sample: int, corner: int, k: int) -> str | None:
    """Return the end of the k-th rod that the corner meets, for which there is no normal; None for its side."""
    for end in (k - 1, k):
        apart = motion.corners[corner] - motion.corners[end]
        way = apart[:, sample] - apart[:, sample + 1]
        n = way / np.hypot(*way)
        if abs(n[0] * apart[1, sample] - n[1] * apart[0, sample]) < TOGETHER:
            return named(end)
    return None


def largest_change(terms: Terms) -> tuple[float, float]:
    """Return the largest change of a sum from its first value, and beside the sum of the sizes of its terms then."""
    total, sizes = terms.sum(axis=0), np.linalg.norm(terms[..., 1:], axis=1).sum(axis=0)
    changes = np.linalg.norm(total[:, 1:] - total[:, :1], axis=0)
    return float(changes.max()), float((changes / sizes).max())


@dataclass(frozen=True)
class Row:
    """What becomes of one chain: impulse (N s), apparent mass (kg), and the largest change of what should stay.

    `kept` are those of momentum (kg m/s), angular momentum (kg m^2/s) and energy (J), `missed` the same beside the
    sums of the sizes of their terms.
    """

    impulse: float
    apparent_mass: float
    meeting: Meeting
    kept: Sequence[float]
    missed: Sequence[float]

    @staticmethod
    def of(struck: int, side: str, turn: str) -> Row:
        """The row of one chain."""
        system = chain(struck, side, turn)
        impact = mbs.solve(system).impact
        motions, meeting = met(system)
        courses = zip(*(m.kept() for m in (motions[0].before(side), *motions)), strict=True)
        kept, missed = zip(*(largest_change(np.concatenate(x, axis=-1)) for x in courses), strict=True)
        mass = impact.apparent_mass["impact"].value
        return Row(impact.impulses["impact"]["normal"].value, mass, meeting, kept, missed)

    def __str__(self) -> str:
        at, kept = self.meeting, " | ".join(f"{x:.0e}" for x in self.kept)
        given = f"{self.impulse:.9f} | {self.apparent_mass:.9f}"
        return f"{given} | {at.t:.6f} | {at.corner}, {at.other} | {at.impulse:.6f} | {kept} |"


def of_rods(struck: int, side: str, turn: str) -> str:
    """Velocities, instantaneous centres and hinges' impulses of one chain."""
    impact = mbs.solve(chain(struck, side, turn)).impact
    lines = ["| rod | omega rad/s | centre m | hinge fx, fy N*s |", "|---|---|---|---|"]
    turning = np.cumsum([impact.after[f"u_phi{k}"].value for k in RODS])
    for k, omega in zip(RODS, turning, strict=True):
        centre = impact.instantaneous_centres[f"rod{k}"]
        (kind, place), hinge = next(iter(centre.items())), impact.joint_impulses.get(f"hinge{k}", {})
        passed = ", ".join(f"{hinge[name].value:.9f}" for name in ("fx", "fy") if name in hinge)
        lines.append(f"| {k} | {omega:.9f} | {kind} {place[0]:.6f}, {place[1]:.6f} | {passed} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    asked = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    asked.add_argument("--rod", type=int, choices=RODS, default=4)
    asked.add_argument("--side", choices=SIDES, default="outside")
    asked.add_argument("--turn", default="pi/10", help="the angle at each hinge")
    asked.add_argument("--all", action="store_true", help="each rod, from both sides, turned by pi/10 and pi/11")
    given = asked.parse_args(arguments)
    if given.all:
        cases = [(k, side, turn) for turn in ("pi/10", "pi/11") for side in SIDES for k in RODS]
    else:
        cases = [(given.rod, given.side, given.turn)]
        print(of_rods(*cases[0]) + "\n")
    print(HEAD)
    missed = []
    for case in cases:
        row = Row.of(*case)
        missed.append(row.missed)
        print(f"| {' | '.join(map(str, case))} | {row}", flush=True)
    largest = (f"{name} {x:.1e}" for name, x in zip(KEPT, np.max(missed, axis=0), strict=True))
    print(f"\nlargest relative miss of {len(cases)} motions: {', '.join(largest)}")


if __name__ == "__main__":
    main()
