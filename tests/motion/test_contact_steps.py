"""Time stepping of contacts: closed forms, runs from event to event, the exact search of impulses, statics."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.contact_laws.impact_sequence import ContactRows, sweep
from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, LawProblem, Unilateral
from multibody_sym.contact_laws.search import find

RADIUS, G, MU, E = 0.2, 9.81, 0.3, 0.2


def discs(count, columns, *, gravity=G, restitution=E, speed=0.0, floor=True, wide=0.401):
    """Return discs in rows over a floor between walls; without a floor they fly against each other."""
    half = 0.5 * wide * columns + 0.06
    walls = {
        "floor": mbs.Surface(plane=[0, 0, 0], normal="y"),
        "left": mbs.Surface(plane=[-half, 0, 0], normal="x"),
        "right": mbs.Surface(plane=[half, 0, 0], normal="-x"),
    }
    bodies, joints, contacts = {"ground": mbs.Body(surfaces=walls)}, {}, {}
    law = {"static": MU, "restitution": restitution}
    for i in range(count):
        row, column = divmod(i, columns)
        bodies[f"b{i}"] = mbs.Body(mass=1, inertia={"Izz": 0.016}, surfaces={"rim": mbs.Surface(disc=RADIUS)})
        x = (column - 0.5 * (columns - 1)) * wide + 0.05 * (row % 2)
        start = {"q": [x, 0.21 + 0.401 * row, 0], "u": [-speed * x, -speed * row, speed * i]}
        joints[f"j{i}"] = mbs.Planar("ground", f"b{i}", q=[f"x{i}", f"y{i}", f"t{i}"], initial=start)
        touched = walls if floor else {}
        contacts |= {f"c{i}_{wall}": mbs.Contact([f"b{i}.rim", f"ground.{wall}"], **law) for wall in touched}
        contacts |= {f"c{i}_{k}": mbs.Contact([f"b{i}.rim", f"b{k}.rim"], **law) for k in range(i)}
    return mbs.System("discs", gravity=[0, -gravity, 0], bodies=bodies, joints=joints, contacts=contacts)


def overlap(places):
    """Return how far (m) discs at places x, y (count, 2) are inside each other or the floor, at most."""
    apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)] - 2 * RADIUS
    return -min(float(apart.min()), float(places[:, 1].min()) - RADIUS)


@pytest.fixture(scope="module")
def heap():
    """Three rows of three discs that fall into a box until they rest."""
    return mbs.simulate(discs(9, 3), t_end=1.0, method="moreau", step=1e-3, samples=101)


def test_a_heap_comes_to_rest_apart_and_all_energy_is_accounted_for(heap) -> None:
    places = heap.q.reshape(101, 9, 3)[:, :, :2]
    assert max(map(overlap, places)) < 1e-9
    assert np.abs(heap.u[-1]).max() < 1e-6
    assert heap.energy_residual == pytest.approx(0.0, abs=1e-3)
    assert sum(heap.impact_losses.values()) > 0.5
    assert sum(work.total for work in heap.friction_work.values()) < -0.1
    assert np.diff(heap.energy).max() < 1e-4  # what lifts discs off each other, and no impulse
    assert heap.statistics["method"] == "moreau"
    assert heap.statistics["steps"] == 1000


def test_a_run_by_steps_has_one_library_which_watches_no_contact_and_holds_no_row(heap) -> None:
    compiled = heap.ready.compiled
    assert compiled.path == heap.modes.steps.laws.compiled.path
    assert "laws" in compiled
    assert "events" not in compiled
    assert compiled["state_derivative"].signature.outputs[2][1] == (0,)  # multipliers


def test_at_rest_the_floor_carries_the_weight(heap) -> None:
    # The impulses of the last step, divided by it: floor, and walls that rub.
    steps = heap.modes.steps
    names = [x.name for x in steps.laws.unilateral]
    up = sum(p for name, p in zip(names, steps.pressing, strict=True) if name.endswith("floor"))
    rubbing = dict(zip([name.removesuffix("_rub") for name in names], steps.rubbing, strict=True))
    up += sum(z * (-1 if name.endswith("left") else 1) for name, z in rubbing.items() if name[-4:] in ("left", "ight"))
    assert up / 1e-3 == pytest.approx(9 * G, rel=1e-4)


def test_impacts_of_discs_in_flight_keep_momentum() -> None:
    system = discs(9, 3, gravity=0.0, speed=0.7, floor=False)
    run = mbs.simulate(system, t_end=0.3, method="moreau", step=1e-3, samples=31)
    u, q = run.u.reshape(31, 9, 3), run.q.reshape(31, 9, 3)
    np.testing.assert_allclose(u[:, :, :2].sum(axis=1), np.broadcast_to(u[0, :, :2].sum(axis=0), (31, 2)), atol=1e-12)
    spin = (q[:, :, 0] * u[:, :, 1] - q[:, :, 1] * u[:, :, 0] + 0.016 * u[:, :, 2]).sum(axis=1)
    np.testing.assert_allclose(spin, spin[0], atol=2e-6)
    assert len(run.impact_losses) > 5
    assert run.energy_residual == pytest.approx(0.0, abs=1e-8)


SLIDES = """
multibody_sym: 1
name: slides
gravity: [0, -9.81, 0]
parameters: {mu: 0.3}
bodies: {b: {mass: 2}, ground: {surfaces: {face: {plane: [0, 0, 0], normal: y}}}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [0, 0], u: [3, 0]}}}
contacts: {c: {between: [b, ground.face], static: 0.4, kinetic: mu}}
simulation: {t_end: 2, method: moreau, step: 1 ms, samples: 5}
"""


def test_a_block_slides_as_far_as_friction_lets_it() -> None:
    run = mbs.simulate(mbs.loads(SLIDES))
    assert run["x"][-1] == pytest.approx(9 / (2 * MU * G), abs=1e-4)
    assert run.u[-1, 0] == 0.0
    assert run.friction_work["c"].total == pytest.approx(-9.0, abs=1e-9)
    back = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(back.q, run.q)
    assert back.energy_residual == run.energy_residual


BALLS = """
multibody_sym: 1
name: balls
gravity: [0, 0, -9.81]
bodies:
  a: {mass: 1, inertia: {Ixx: 0.016, Iyy: 0.016, Izz: 0.016}, surfaces: {s: {sphere: 0.2}}}
  b: {mass: 1, inertia: {Ixx: 0.016, Iyy: 0.016, Izz: 0.016}, surfaces: {s: {sphere: 0.2}}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
joints:
  ja: {type: free, parent: ground, child: a, initial: {q: [0, 0, 0.5, 1, 0, 0, 0], u: [0.5, 0.2, 0, 0, 0, 1]}}
  jb: {type: free, parent: ground, child: b, initial: {q: [0.05, 0.02, 1, 1, 0, 0, 0]}}
contacts:
  c1: {between: [a.s, ground.floor], static: 0.3, restitution: 0.4}
  c2: {between: [b.s, ground.floor], static: 0.3, restitution: 0.4}
  c3: {between: [a.s, b.s], static: 0.3, restitution: 0.4}
"""


def test_balls_in_space_go_the_way_of_a_run_from_event_to_event() -> None:
    # Impacts come one after the other, so that Newton's law of all at once is that of one: the error is of order 1.
    system, errors = mbs.loads(BALLS), []
    for step in (1e-3, 2.5e-4):
        exact = mbs.simulate(system, t_end=0.35, samples=5)
        run = mbs.simulate(system, t_end=0.35, samples=5, method="moreau", step=step)
        errors.append(np.abs(run.q - exact.q).max())
    assert errors[0] < 4e-3
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("angle", [20, 45, 62.5])
def test_an_elastic_impact_gives_all_of_the_speed_back(angle: float) -> None:
    """A stick m = 1, I = 1/12 falls on its tip: the impulse is 2 v/(1/m + (sin(a)/2)^2/I)."""
    arm = 0.5 * math.sin(math.radians(angle))
    stick = mbs.Body(mass=1, inertia={"Izz": "1/12"}, points={"tip": [0, -0.5, 0]})
    floor = mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")})
    start = {"q": [0, 0.01 + 0.5 * math.cos(math.radians(angle)), f"{angle} deg"], "u": [0, -0.5, 0]}
    system = mbs.System(
        "stick", bodies={"ground": floor, "stick": stick},
        joints={"free": mbs.Planar("ground", "stick", q=["x", "y", "a"], initial=start)},
        contacts={"c": mbs.Contact(["stick.tip", "ground.floor"], restitution=1)},
    )
    run = mbs.simulate(system, t_end=0.03, samples=2, method="moreau", step=1e-3, backend="python")
    impulse = 2 * 0.5 / (1 + 12 * arm**2)
    assert run["u_y"][-1] == pytest.approx(impulse - 0.5, abs=1e-6)
    assert run["u_a"][-1] == pytest.approx(12 * arm * impulse, abs=1e-6)


def test_sweeps_come_to_the_impulses_that_the_search_finds() -> None:
    # Contacts in the plane without dependent rows have unique speeds.
    rng = np.random.default_rng(28)
    for _ in range(20):
        count = 4
        A, v = rng.normal(size=(2 * count, 3 * count)), rng.normal(size=2 * count)
        laws = (*[Unilateral()] * count, *[FrictionRow(k, 0) for k in range(count)])
        parts = tuple(FrictionLaw((count + k,), (k,), MU, MU, (0.0,)) for k in range(count))
        found = find(LawProblem(A, A, np.zeros((2 * count, 2 * count)), -v, laws, parts), every=False)
        z, x = np.zeros(2 * count), np.zeros(3 * count)
        done = sweep(rows_of(A, count), v, np.full(count, MU), (z, x), 1e-14, 100_000)
        assert done < 100_000
        np.testing.assert_allclose(x, found.states[0].x, atol=1e-10)
        np.testing.assert_allclose(x, A.T @ z, atol=1e-12)


def rows_of(A, count):
    """Return the rows of contacts in the plane, all elements of which are there."""
    m, n = A.shape
    begins, places = np.arange(m + 1) * n, np.tile(np.arange(n), m)
    rubs, presses = np.arange(count, m + 1), np.arange(count)
    numbers = (each.astype(np.intc) for each in (begins, places))
    return ContactRows(*numbers, A.ravel(), rubs.astype(np.intc), presses.astype(np.intc), n)


def test_c_and_python_have_the_same_bits() -> None:
    system = discs(6, 3, wide=0.43)
    runs = [
        mbs.simulate(system, t_end=0.25, method="moreau", step=2e-3, samples=26, backend=backend)
        for backend in ("c", "python")
    ]
    assert np.abs(runs[0].u[-1]).max() > 0.0
    np.testing.assert_array_equal(runs[0].q, runs[1].q)
    np.testing.assert_array_equal(runs[0].u, runs[1].u)


def test_many_contacts_go_by_steps_unless_something_else_is_asked_for() -> None:
    from multibody_sym.mechanics.resolve import mechanism
    from multibody_sym.motion.prepare import settings as time_stepping
    from multibody_sym.motion.prepare.settings import steps_over_contacts

    system, few = discs(6, 3), time_stepping.MANY_CONTACTS
    declared = mechanism(system)
    many = replace(declared, one_way=declared.one_way * (few // len(declared.one_way) + 1))
    settings = system.simulation
    assert not steps_over_contacts(settings, declared)
    assert steps_over_contacts(settings, many)
    for word in ("dormand_prince", "radau_5"):
        assert not steps_over_contacts(replace(settings, method=word), many)
    for name in ("rtol", "atol", "step"):
        asked = mbs.loads(SLIDES.replace("method: moreau, step: 1 ms", f"{name}: 1e-6")).simulation
        assert not steps_over_contacts(asked, many)
    assert steps_over_contacts(replace(settings, method="moreau"), declared)


def test_forces_and_times_between_samples_are_refused() -> None:
    run = mbs.simulate(mbs.loads(SLIDES))
    for asked in ("reactions", "accelerations", "multipliers"):
        with pytest.raises(mbs.InputError, match="impulses of steps, not forces and accelerations at an instant"):
            getattr(run, asked)
    with pytest.raises(mbs.InputError, match="known at its samples only: ask for more `samples`"):
        run(0.3)
    with pytest.raises(mbs.InputError, match="a Stepper, and inputs that functions give, take no method moreau"):
        mbs.prepare(mbs.loads(SLIDES)).stepper(0.01)
    assert math.isfinite(run.energy_residual)
