"""Kinks that are crossed and crossed back within a step: pairs of bodies on a line that touch for a moment.

Two bodies with a one-sided linear spring of stiffness k between them touch for half a period, pi*sqrt(mu/k), and then
part as after an elastic collision, whatever the step was that brought them together.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs

PAIR = """
multibody_sym: 1
name: pair
parameters: {k: 10, R: 1, x: -3, va: 2, vb: 0, ma: 1, mb: 1}
bodies: {a: {mass: ma}, b: {mass: mb}}
joints:
  to_a: {type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {q: x, u: va}}
  to_b: {type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {u: vb}}
forces: {touch: {type: pull, between: [a, b], value: "-k*max(R - distance, 0)"}}
"""
LOOPS = pytest.mark.parametrize("backend", ["c", "python"])


@pytest.mark.parametrize(
    ("method", "step"),
    [
        *(("dormand_prince", None), ("dormand_prince_8", None), ("bogacki_shampine", None), ("radau_3", None)),
        *(("rk4", 0.03), ("stoermer_6", 0.03), ("gauss_4", 0.03), ("radau_5", None)),
    ],
)
def test_both_loops_meet_a_contact_in_the_same_steps(method: str, step: float | None) -> None:
    system = mbs.loads(PAIR)
    in_c, in_python = (
        mbs.simulate(system, t_end=4, method=method, step=step, samples=9, rtol=None if step else 1e-6, backend=loop)
        for loop in ("c", "python")
    )
    counts = [{k: v for k, v in run.statistics.items() if k != "backend"} for run in (in_c, in_python)]
    assert counts[0] == counts[1]
    assert [e.index for e in in_c.integration.events] == [e.index for e in in_python.integration.events] == [0, 0]
    np.testing.assert_allclose(in_c["u_xa"], in_python["u_xa"], atol=1e-12)


PUSHED = """
multibody_sym: 1
name: pushed
bodies: {block: {mass: 2}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
inputs: {w: WAVE}
forces: {push: {type: force, on: block, value: [w, 0, 0]}}
"""


@LOOPS
def test_no_step_leads_over_a_pulse_of_a_long_table(backend: str) -> None:
    """Of 200 rows 4 make a rectangle a millisecond wide, with edges of a microsecond, at every 2 s."""
    starts = range(1, 99, 2)
    rows = [[t + dt, w] for t in starts for dt, w in ((0, 0), (1e-6, 1000), (1e-3, 1000), (1.001e-3, 0))]
    run = mbs.simulate(mbs.loads(PUSHED.replace("WAVE", f"{{table: {rows}}}")), t_end=100, backend=backend, samples=2)
    assert 2 * run["u_x"][-1] == pytest.approx(len(starts), rel=1e-6)


METHODS = {
    "dormand_prince": {},
    "dormand_prince_8": {},
    "bogacki_shampine": {"rtol": 1e-7, "atol": 1e-7},
    "radau_5": {},
    "RK45": {},
    "stoermer_6": {"step": 0.05},  # of the contact's duration
}


def contacts_missed(method: str, seed: int, count: int) -> list[dict[str, float]]:
    """Return the parameters of random pairs whose final speeds are not those of an elastic collision."""
    random, system, missed = np.random.default_rng(seed), mbs.loads(PAIR), []
    for _ in range(count):
        ma, mb, k, closing = 10 ** random.uniform([-1, -1, 0, -1], [1, 1, 4, 1])
        reduced = ma * mb / (ma + mb)
        duration = math.pi * math.sqrt(reduced / k)
        t_end = duration * 10 ** random.uniform(1, 4)
        radius = closing / math.sqrt(k / reduced) * random.uniform(1.2, 20)  # of which less than 1/1.2 is pressed in
        vb = random.normal()
        va, start = vb + closing, random.uniform(0.01, 0.99) * (t_end - duration)
        parameters = {"k": k, "R": radius, "x": -radius - closing * start, "va": va, "vb": vb, "ma": ma, "mb": mb}
        settings = {name: x * duration if name == "step" else x for name, x in METHODS[method].items()}
        run = mbs.simulate(system, t_end=t_end, method=method, parameters=parameters, samples=2, **settings)
        mean = (ma * va + mb * vb) / (ma + mb)
        error = max(abs(run["u_xa"][-1] - (2 * mean - va)), abs(run["u_xb"][-1] - (2 * mean - vb)))
        if not error < 1e-4 * closing or run["xa"][-1] >= run["xb"][-1]:
            missed.append({**parameters, "duration": duration, "t_end": t_end, "start": start, "error": error})
    return missed


@pytest.mark.parametrize("method", list(METHODS))
def test_no_contact_of_random_pairs_is_missed(method: str) -> None:
    """The runs take 10 to 10^4 times as long as the contact."""
    assert contacts_missed(method, 1, {"RK45": 20, "stoermer_6": 10}.get(method, 50)) == []


@pytest.mark.long
@pytest.mark.parametrize("method", list(METHODS))
def test_no_contact_of_many_random_pairs_is_missed(method: str) -> None:
    assert contacts_missed(method, 2, 500) == []


LINE = """
multibody_sym: 1
name: line
parameters: {k: 1, ma: 1, mb: 1, mc: 1, a: 0, b: 2, c: 4, va: 0, vb: 0, vc: 0}
bodies: {a: {mass: ma}, b: {mass: mb}, c: {mass: mc}}
joints:
  to_a: {type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {q: a, u: va}}
  to_b: {type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {q: b, u: vb}}
  to_c: {type: prismatic, parent: ground, child: c, axis: x, q: xc, initial: {q: c, u: vc}}
forces:
  left: {type: pull, between: [a, b], value: "-k*max(1 - distance, 0)"}
  right: {type: pull, between: [b, c], value: "-k*max(1 - distance, 0)"}
"""


def collided(masses: list[float], places: list[float], speeds: list[float]) -> list[float]:
    """Return the speeds of bodies of length 1 on a line after all their elastic collisions, found one by one."""
    x, u = list(places), list(speeds)
    while True:
        times = [(x[i + 1] - x[i] - 1) / (u[i] - u[i + 1]) if u[i] - u[i + 1] > 1e-12 else math.inf for i in (0, 1)]
        if min(times) == math.inf:
            return u
        i = times.index(min(times))
        x = [place + speed * times[i] for place, speed in zip(x, u, strict=True)]
        mean = (masses[i] * u[i] + masses[i + 1] * u[i + 1]) / (masses[i] + masses[i + 1])
        u[i], u[i + 1] = 2 * mean - u[i], 2 * mean - u[i + 1]


@pytest.mark.parametrize("method", ["dormand_prince", "dormand_prince_8", "radau_5", "DOP853"])
def test_bodies_on_a_line_touch_until_they_part(method: str) -> None:
    """Stiff contacts far apart: speeds are those of collisions, in which stages of long steps meet wild forces."""
    random, system = np.random.default_rng(11), mbs.loads(LINE)
    for _ in range(4 if method == "DOP853" else 15):
        masses, speeds = 10 ** random.uniform(-1, 1, 3), random.normal(size=3)
        places = np.cumsum(random.uniform(2, 40, 3))
        named = zip("abc", masses, places, speeds, strict=True)
        parameters = {"k": 1e9} | {key: x for n, m, s, v in named for key, x in ((f"m{n}", m), (n, s), (f"v{n}", v))}
        run = mbs.simulate(system, t_end=2000, method=method, parameters=parameters, samples=2)
        found = [run[f"u_x{n}"][-1] for n in "abc"]
        np.testing.assert_allclose(found, collided(masses, places, speeds), atol=1e-3 * np.abs(speeds).max())


@pytest.mark.parametrize("method", ["BDF", "Radau", "LSODA", "RK45"])
def test_libraries_meet_a_contact_that_jumps(method: str) -> None:
    """The bodies part again after 2 v / (F/mu): with the constant force 100 N it takes 0.02 s."""
    system = mbs.loads(PAIR.replace("-k*max(R - distance, 0)", "-50*(1 + sign(0.1 - distance))"))
    run = mbs.simulate(system, t_end=20, method=method, backend="python", samples=2)
    assert (run["u_xa"][-1], run["u_xb"][-1]) == pytest.approx((0, 2), abs=1e-6)
    assert [event.time for event in run.integration.events] == pytest.approx([1.45, 1.47], abs=1e-7)


def test_a_contact_that_opens_far_away_opens_where_floats_hardly_tell() -> None:
    """300 m away a gap that closes with 0.1 m/s is the same float for some 1e-13 s.

    Steps as short led to the very end of the contact and never beyond it, and Stoermer's method took speeds from
    displacements of no more digits: the bodies stuck together, and momentum was lost.
    """
    parameters = {
        **{"k": 26.785966601176753, "R": 0.05817777286091352, "x": -14.696434016380287, "vb": -2.17124485030397},
        **{"va": -2.0685455790003284, "ma": 0.14315242770541492, "mb": 0.29081985698536933},
    }
    step = 0.05 * 0.18800811753819208
    run = mbs.simulate(
        mbs.loads(PAIR), t_end=143, method="stoermer_6", step=step, parameters=parameters, samples=2, backend="c"
    )
    ma, mb, va, vb = (parameters[name] for name in ("ma", "mb", "va", "vb"))
    mean = (ma * va + mb * vb) / (ma + mb)
    assert (run["u_xa"][-1], run["u_xb"][-1]) == pytest.approx((2 * mean - va, 2 * mean - vb), abs=1e-6)
    (start, end) = (event.time for event in run.integration.events)
    assert end - start == pytest.approx(math.pi * math.sqrt(ma * mb / (ma + mb) / parameters["k"]), rel=1e-6)
