"""The figure of eleven_rods.yaml: velocities and instantaneous centres just after the impact.

    python eleven_rods_figure.py [FILE]

Writes eleven_rods.svg unless another file (svg, pdf, png) is named; needs matplotlib.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from eleven_rods import system
from matplotlib.figure import Figure

import multibody_sym as mbs

RODS = range(1, 12)
ANGLES = np.array([(6 - k) * np.pi / 10 for k in RODS])
ALONG = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
RADIUS = 1 / (2 * np.tan(np.pi / 20))
CENTRES = RADIUS * np.column_stack([-np.sin(ANGLES), np.cos(ANGLES)])
CORNERS = np.vstack([CENTRES[:1] - ALONG[:1] / 2, CENTRES + ALONG / 2])
LOW, HIGH = np.array([-4.6, -1.1]), np.array([4.6, 6.9])
SCALE = 1.5
"""What a velocity of 1 m/s is drawn as, in m."""
INK, RED, BLUE = "black", "#b2182b", "#2166ac"


def velocities(after: Any) -> Any:
    """Velocities (12, 2) of the ends and hinges, from the speeds after the impact."""
    turning = np.cumsum([after[f"u_phi{k}"].value for k in RODS])
    rates = [[after["u_x1"].value, after["u_y1"].value]]
    across = np.column_stack([-ALONG[:, 1], ALONG[:, 0]]) * turning[:, None]
    return np.cumsum(np.vstack([rates, across]), axis=0)


def arrow(axes: Any, start: Any, way: Any, colour: str) -> None:
    """An arrow with its tip drawn to scale."""
    style = {
        "arrowstyle": "-|>,head_width=0.16,head_length=0.32",
        "color": colour,
        "lw": 1.0,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    axes.annotate("", xy=start + way, xytext=start, arrowprops=style, zorder=4)


def inside(point: Any) -> bool:
    """Whether a point is in the picture."""
    return bool((point > LOW).all() and (point < HIGH).all())


def chain(axes: Any, rates: Any) -> None:
    """The rods with their numbers, the hinges, and the velocities of both."""
    axes.plot(*CORNERS.T, color=INK, lw=3.0, solid_capstyle="round", zorder=2)
    axes.plot(*CORNERS[1:-1].T, "o", ms=5, mfc="white", mec=INK, mew=1.2, zorder=3)
    for k in RODS:
        middle = CENTRES[k - 1]
        arrow(axes, middle, SCALE * (rates[k] + rates[k - 1]) / 2, RED)
        axes.text(*(middle * (1 - 0.2 / RADIUS)), str(k), ha="center", va="center", fontsize=9, zorder=5)
    for corner, rate in zip(CORNERS, rates, strict=True):
        arrow(axes, corner, SCALE * rate, "0.55")


def poles(axes: Any, centres: dict[str, Any]) -> None:
    """The instantaneous centres, and the lines through neighbours' centres and their hinge."""
    places = {k: np.array(centres[f"rod{k}"]["centre"]) for k in RODS}
    for k in RODS[:-1]:
        ends = np.array([places[k], CORNERS[k], places[k + 1]])
        axes.plot(*ends.T, color=BLUE, lw=0.5, ls=(0, (6, 4)), zorder=1)
    shift = {6: (0.2, -0.2), 9: (-0.22, -0.22), 10: (-0.02, 0.22), 11: (0.24, -0.16)}
    for k, place in places.items():
        if inside(place):
            axes.plot(*place, "x", color=BLUE, ms=6, mew=1.3, zorder=5)
            axes.text(
                *(place + shift.get(k, (0.16, 0.16))), f"$P_{{{k}}}$", color=BLUE, fontsize=10, ha="center", va="center"
            )
    far = ", ".join(f"$P_{{{k}}}$ ({p[0]:.2f}, {p[1]:.2f})" for k, p in places.items() if not inside(p))
    axes.text(*(LOW + 0.1), f"outside the picture: {far}", color=BLUE, fontsize=8)


def figure() -> Figure:
    """The whole figure."""
    impact = mbs.solve(system).impact
    drawn = Figure(figsize=(7.2, 6.4), layout="constrained")
    axes = drawn.subplots()
    chain(axes, velocities(impact.after))
    poles(axes, dict(impact.instantaneous_centres))
    particle = CENTRES[3] * (1 + 0.12 / RADIUS)
    axes.plot(*particle, "o", color=INK, ms=7, zorder=5)
    arrow(axes, particle * (1 + SCALE / np.hypot(*particle)), -particle * SCALE / np.hypot(*particle), INK)
    axes.text(*(particle * 1.36), "$v$", fontsize=11)
    axes.plot(0, 0, "+", color=INK, ms=8)
    axes.text(0.1, 0.1, "$O$", fontsize=10)
    arrow(axes, np.array([-4.3, 6.4]), np.array([SCALE, 0.0]), RED)
    axes.text(-4.3, 6.55, "1 m/s", fontsize=8)
    axes.set(xlim=(LOW[0], HIGH[0]), ylim=(LOW[1], HIGH[1]), aspect="equal", xlabel="x in m", ylabel="y in m")
    axes.set_title(
        f"Eleven rods struck at the fourth: impulse {impact.impulses['impact']['normal'].value:.6f} N s", fontsize=11
    )
    return drawn


if __name__ == "__main__":
    mpl.rcParams.update({"svg.hashsalt": "eleven_rods", "svg.fonttype": "path"})
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix("").with_name("eleven_rods.svg")
    dated = {"metadata": {"Date": None}} if path.suffix == ".svg" else {}
    figure().savefig(path, **dated)
