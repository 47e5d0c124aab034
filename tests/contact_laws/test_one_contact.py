"""One contact by Routh's integration: books' closed forms, and a second route in small steps of the normal impulse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from impact_problems import Impact, random_impact

from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import Equality, FrictionLaw, LawProblem
from multibody_sym.errors import InputError, NoSolutionError

LAWS = ("newton", "poisson", "stronge")


def sphere(u: list[float], mu: float, e: float, *, given_back: float = 0.0, kinetic: float | None = None) -> Impact:
    """Return a homogeneous sphere (m = 2, r = 0.5) on a floor, speeds (v_x, v_y, omega); v_t = v_x + r omega."""
    m, r = 2.0, 0.5
    impact = Impact(np.diag([m, m, 0.4 * m * r * r]), np.array(u))
    impact.contact([0.0, 1.0, 0.0], e, [[1.0, 0.0, r]], mu, kinetic=kinetic, given_back=given_back)
    return impact


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("angle", [0.3, 1.0, math.pi / 2])
def test_a_smooth_rod_falls_on_the_floor(law: str, angle: float) -> None:
    """p = (1 + e) m v / (1 + 3 cos^2 theta) for a rod that falls without turning."""
    m, half, v, e = 3.0, 1.0, 2.0, 0.6
    impact = Impact(np.diag([m, m, m * half**2 / 3]), np.array([0.5, -v, 0.0]))
    impact.contact([0.0, 1.0, -half * math.cos(angle)], e)
    struck = strike(impact.problem(law))
    p = (1 + e) * m * v / (1 + 3 * math.cos(angle) ** 2)
    assert struck.impulses == pytest.approx([p], rel=1e-13)
    assert struck.compression == pytest.approx([p / (1 + e)], rel=1e-13)
    assert struck.energy_lost == pytest.approx(p * (1 - e) * v / 2, rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("forward", [1.0, -1.0])
def test_a_sphere_slips_through_or_rolls_off(law: str, forward: float) -> None:
    """v_t loses 7/2 of mu (1 + e) v_n: slip stops where it is less than that, and 2/7 of m v_t is what stops it."""
    m, e, mu, vn = 2.0, 0.5, 0.2, 3.0
    loss = 3.5 * mu * (1 + e) * vn
    fast = strike(sphere([forward * (loss + 1.0), -vn, 0.0], mu, e).problem(law))
    assert fast.after == pytest.approx([e * vn, forward], rel=1e-13)
    assert fast.impulses == pytest.approx([m * (1 + e) * vn, -forward * mu * m * (1 + e) * vn], rel=1e-13)
    assert fast.course(0) == (forward,)
    slow = strike(sphere([forward * (loss - 1.0), -vn, 0.0], mu, e).problem(law))
    assert slow.after == pytest.approx([e * vn, 0.0], abs=1e-13)
    assert slow.impulses[1] == pytest.approx(-forward * 2 / 7 * m * (loss - 1.0), rel=1e-13)
    assert slow.course(0) == (forward, 0)
    assert slow.lost[1] == pytest.approx(m / 7 * (loss - 1.0) ** 2, rel=1e-12)


def test_a_strut_on_a_pivot_stops_at_once_and_its_friction_holds_it_there() -> None:
    """One speed, mu > cot(angle): slip and normal speed end together, whatever rounding leaves of one of them."""
    inertia, mu, e = 0.7, 0.8, 0.6
    for angle in np.linspace(0.93, 1.5, 40):
        x, y = 1.1 * math.cos(angle), 1.1 * math.sin(angle)
        impact = Impact(np.array([[inertia]]), np.array([-2.3]))
        impact.contact([x], e, [[y]], mu)
        struck = strike(impact.problem("poisson"))
        assert struck.after == pytest.approx([0.0, 0.0], abs=1e-14)
        p = 2.3 * inertia / (x + mu * y)
        assert struck.impulses == pytest.approx([(1 + e) * p, mu * p - e * p * x / y], rel=1e-12)


@pytest.mark.parametrize("spin", [0.0, 4.0, -9.0])
def test_a_superball_reverses_what_slips(spin: float) -> None:
    """With e = 1 and all friction given back v_t is reversed, and no energy is lost."""
    impact = sphere([1.0, -3.0, spin], 5.0, 1.0, given_back=1.0)
    struck = strike(impact.problem("poisson"))
    assert struck.after == pytest.approx([3.0, -(1.0 + 0.5 * spin)], abs=1e-13)
    assert struck.energy_lost == pytest.approx(0.0, abs=1e-12)
    half = strike(sphere([1.0, -3.0, spin], 5.0, 1.0, given_back=0.25).problem("poisson"))
    assert half.after[1] == pytest.approx(-0.25 * (1.0 + 0.5 * spin), abs=1e-13)


def test_a_superball_gives_back_no_more_than_the_cone_allows() -> None:
    mu, m = 0.1, 2.0
    struck = strike(sphere([1.5, -3.0, 0.0], mu, 1.0, given_back=1.0).problem("poisson"))
    assert struck.impulses[1] == pytest.approx(-mu * struck.impulses[0], rel=1e-13)
    assert struck.impulses[1] < -2 / 7 * m * 1.5
    assert [phase.stage for phase in struck.phases][-1] == "given back"


def test_what_never_stops_to_slip_gives_nothing_back() -> None:
    plain, back = (strike(sphere([30.0, -3.0, 0.0], 0.1, 1.0, given_back=b).problem("poisson")) for b in (0.0, 1.0))
    assert back.impulses.tolist() == plain.impulses.tolist()


def test_two_contacts_at_once_give_back_as_one() -> None:
    """The floor declared twice: impulses are shared, the ball flies off as from one floor."""
    twice = sphere([1.0, -3.0, 4.0], 5.0, 1.0, given_back=1.0)
    twice.contact([0.0, 1.0, 0.0], 1.0, [[1.0, 0.0, 0.5]], 5.0, given_back=1.0)
    struck = strike(twice.problem("poisson"))
    assert struck.after == pytest.approx([3.0, -3.0, 3.0, -3.0], abs=1e-12)
    assert struck.not_unique == (0, 1, 2, 3)
    assert struck.energy_lost == pytest.approx(0.0, abs=1e-12)


def test_given_back_is_no_more_than_friction_took() -> None:
    """What sticks from the first has taken nothing, however large its p_t is where K_nt is not zero."""
    impact = Impact(np.linalg.inv(np.array([[1.0, 0.5], [0.5, 1.0]])), np.array([-1.0, 0.0]))
    impact.contact([1.0, 0.0], 1.0, [[0.0, 1.0]], 2.0, given_back=1.0)
    struck = strike(impact.problem("poisson"))
    assert struck.impulses[1] == pytest.approx(-struck.impulses[0] / 2, rel=1e-13)
    assert struck.energy_lost == pytest.approx(0.0, abs=1e-13)


def test_friction_that_is_always_enough_stops_slip_at_once() -> None:
    impact = sphere([4.0, -3.0, 0.0], 0.0, 0.5)
    impact.parts[0] = FrictionLaw((1,), (0,), 0.0, 0.0, enough=True)
    struck = strike(impact.problem("poisson"))
    assert struck.after == pytest.approx([1.5, 0.0], abs=1e-14)
    assert struck.impulses[1] == pytest.approx(-2 / 7 * 2.0 * 4.0)


# --- second routes ----------------------------------------------------------------------------------------------------


def in_small_steps(impact: Impact, law: str, dp: float) -> np.ndarray:
    """Return the impulses (n, t...) of a lone contact by steps of the normal impulse, W dense: stop within a step."""
    W = impact.H @ np.linalg.solve(impact.M, impact.H.T)
    v, mu, e = impact.H @ impact.u, impact.parts[0].kinetic, impact.e[0]
    first, total, work, compressed = v[0], np.zeros(len(v)), 0.0, None
    while True:
        tangent = -np.linalg.solve(W[1:, 1:], v[1:] / dp + W[1:, 0])  # what brings it to rest within the step
        if (size := float(np.linalg.norm(tangent))) > mu:
            tangent = -mu * v[1:] / np.linalg.norm(v[1:]) if len(v) > 2 else tangent * (mu / size)
        p = dp * np.concatenate([[1.0], tangent])
        work += (v[0] + W[0] @ p / 2.0) * dp
        total, v = total + p, v + W @ p
        if compressed is None and v[0] >= 0.0:
            compressed = total[0], work
        if compressed is not None:
            ends = {
                "newton": v[0] >= -e * first,
                "poisson": total[0] >= (1.0 + e) * compressed[0],
                "stronge": work >= (1.0 - e * e) * compressed[1],
            }
            if ends[law]:
                return total


def with_friction(impact: Impact) -> Impact:
    part = impact.parts[0]
    impact.parts[0] = FrictionLaw(part.rows, part.normals, part.static or 0.3, part.kinetic or 0.3)
    return impact


def test_impacts_in_the_plane_are_those_in_small_steps() -> None:
    courses = set()
    for seed in range(24):
        impact, law = with_friction(random_impact(np.random.default_rng(seed), 1)), LAWS[seed % 3]
        struck = strike(impact.problem(law))
        small = in_small_steps(impact, law, struck.impulses[0] / 1000)
        assert struck.impulses == pytest.approx(small, abs=5e-3 * float(np.abs(small).max())), seed
        assert impact.missed(struck) < 1e-12
        courses.add(struck.course(0))
    assert {(1,), (-1,), (-1, 0), (1, 0), (1, -1), (-1, 1)} == courses


def test_slip_that_is_reversed_stops_at_its_place() -> None:
    """K = [[1, 0.6], [0.6, 1]]: slip at v_t = -0.8 stops at p = 0.8 / 0.9 and turns round, as 0.6 > mu = 0.3."""
    K = np.array([[1.0, 0.6], [0.6, 1.0]])
    impact = Impact(np.linalg.inv(K), np.array([-2.0, -0.8]))
    impact.contact([1.0, 0.0], 1.0, [[0.0, 1.0]], 0.3)
    struck = strike(impact.problem("poisson"))
    stop = 0.8 / 0.9
    compressed = stop + (2.0 - 1.18 * stop) / (1.0 - 0.18)
    assert struck.course(0) == (-1, 1)
    assert struck.compression[0] == pytest.approx(compressed, rel=1e-14)
    assert struck.impulses == pytest.approx([2 * compressed, 0.3 * stop - 0.3 * (2 * compressed - stop)], rel=1e-14)
    assert [(phase.stage, phase.slips) for phase in struck.phases] == [
        ("compression", (-1,)),
        ("compression", (1,)),
        ("restitution", (1,)),
    ]


@pytest.mark.parametrize("law", LAWS)
def test_a_contact_whose_speed_falls_first_is_compressed_all_the_same(law: str) -> None:
    """Painleve: while it slips v_n' = 1 - mu K_nt < 0, until slip stops."""
    K = np.array([[1.0, 0.9], [0.9, 1.0]])
    impact = Impact(np.linalg.inv(K), np.array([-0.1, 1.0]))
    impact.contact([1.0, 0.0], 0.5, [[0.0, 1.0]], 2.0)
    struck = strike(impact.problem(law))
    stop = 1.0 / (2.0 - 0.9)
    assert struck.phases[0].impulses[0] == pytest.approx(stop, rel=1e-14)
    assert struck.compression[0] == pytest.approx(stop + (0.1 + 0.8 * stop) / (1 - 0.81), rel=1e-13)
    assert impact.gain(struck) < 0.0 or law == "newton"


@pytest.mark.parametrize("law", LAWS)
def test_the_static_coefficient_decides_at_rest_and_the_kinetic_one_on_the_way(law: str) -> None:
    """K_nt / K_tt = 0.5: it sticks at 0.6, slips at 0.4; what slips has 0.1."""
    K = np.array([[1.0, 0.5], [0.5, 1.0]])
    for static, friction in ((0.6, 0.5), (0.4, 0.1)):
        impact = Impact(np.linalg.inv(K), np.array([-1.0, 0.0]))
        impact.contact([1.0, 0.0], 0.0, [[0.0, 1.0]], static, kinetic=0.1)
        struck = strike(impact.problem(law))
        assert struck.impulses[1] / struck.impulses[0] == pytest.approx(-friction, rel=1e-13)


# --- in space ---------------------------------------------------------------------------------------------------------


def test_impacts_in_space_are_those_in_small_steps() -> None:
    for seed in range(12):
        impact, law = with_friction(random_impact(np.random.default_rng(seed), 1, tangents=2)), LAWS[seed % 3]
        struck = strike(impact.problem(law))
        small = in_small_steps(impact, law, struck.impulses[0] / 2000)
        assert struck.impulses == pytest.approx(small, abs=2e-2 * float(np.abs(small).max())), seed
        assert impact.missed(struck) < 1e-12


def test_a_sphere_in_space_is_one_in_the_plane_of_its_slip() -> None:
    """K is the same in all directions: the way of slip does not turn, whatever the tangents."""
    m, r, turn = 2.0, 0.5, 0.7
    v = 10.0 * np.array([math.cos(turn), math.sin(turn)])
    space = Impact(np.diag([m, m, m, 0.4 * m * r * r, 0.4 * m * r * r]), np.array([*v, -3.0, 0.0, 0.0]))
    space.contact([0, 0, 1.0, 0, 0], 0.5, [[1.0, 0, 0, 0, r], [0, 1.0, 0, -r, 0]], 0.2)
    struck = strike(space.problem("poisson"))
    plane = strike(sphere([10.0, -3.0, 0.0], 0.2, 0.5).problem("poisson"))
    assert struck.impulses[0] == pytest.approx(plane.impulses[0], rel=1e-14)
    assert struck.impulses[1:] == pytest.approx(plane.impulses[1] * v / 10.0, rel=1e-13)
    assert struck.energy_lost == pytest.approx(plane.energy_lost, rel=1e-12)


def dear(K: np.ndarray, mu: float, v: np.ndarray, stop: float, digits: int = 30) -> tuple[np.ndarray, float]:
    """Return v and the loss by friction after a normal impulse, while it slips, by mpmath's Taylor series."""
    import mpmath

    with mpmath.workdps(digits):
        M = [[mpmath.mpf(float(x)) for x in row] for row in K]

        def rates(_: object, y: list) -> list:
            size = mpmath.hypot(y[1], y[2])
            f = [mpmath.mpf(1), -mu * y[1] / size, -mu * y[2] / size]
            return [mpmath.fdot(M[k], f) for k in range(3)] + [mu * size]

        end = mpmath.odefun(rates, 0, [*map(mpmath.mpf, v.tolist()), mpmath.mpf(0)], tol=mpmath.mpf("1e-18"))(stop)
        return np.array([float(x) for x in end[:3]]), float(end[3])


def test_slip_that_turns_is_exact_to_twelve_digits() -> None:
    """Against a Taylor series of 18 digits, at the normal impulse of its own end."""
    K = np.array([[1.0, 0.3, -0.2], [0.3, 2.0, 0.4], [-0.2, 0.4, 0.7]])
    v, mu, e = np.array([-1.0, 1.2, -0.9]), 0.4, 0.7
    impact = Impact(np.linalg.inv(K), v)
    impact.contact([1.0, 0, 0], e, [[0, 1.0, 0], [0, 0, 1.0]], mu)
    struck = strike(impact.problem("poisson"))
    assert struck.course(0) == (2,)
    compressed = dear(K, mu, v, struck.compression[0])[0]
    assert abs(compressed[0]) < 1e-12
    assert struck.impulses[0] == pytest.approx((1 + e) * struck.compression[0], rel=1e-14)
    after, lost = dear(K, mu, v, struck.impulses[0])
    assert struck.after == pytest.approx(after, abs=1e-12)
    assert struck.lost[1:].sum() == pytest.approx(lost, rel=1e-12)


def test_slip_in_space_from_rest_goes_straight_where_it_can() -> None:
    """K_tn is too large for mu to stick: slip starts along K_tn - mu K_tt e, and that direction stays."""
    K = np.array([[1.0, 0.5, 0.2], [0.5, 1.0, 0.1], [0.2, 0.1, 0.6]])
    impact = Impact(np.linalg.inv(K), np.array([-3.0, 0.0, 0.0]))
    impact.contact([1.0, 0, 0], 0.5, [[0, 1.0, 0], [0, 0, 1.0]], 0.35)
    struck = strike(impact.problem("poisson"))
    e = struck.after[1:] / np.linalg.norm(struck.after[1:])
    pushed = K[1:, 0] - 0.35 * K[1:, 1:] @ e
    assert e @ pushed == pytest.approx(float(np.linalg.norm(pushed)), rel=1e-14)
    assert struck.impulses[1:] == pytest.approx(-0.35 * struck.impulses[0] * e, rel=1e-12)
    assert impact.missed(struck) < 1e-13


def test_slip_in_space_that_stops_sticks_then() -> None:
    """K is alike in all directions but for a little: slip stops on a way that turns, and what sticks stays."""
    K = np.array([[1.0, 0.05, -0.1], [0.05, 1.0, 0.1], [-0.1, 0.1, 1.2]])
    impact = Impact(np.linalg.inv(K), np.array([-3.0, -0.3, 0.2]))
    impact.contact([1.0, 0, 0], 0.5, [[0, 1.0, 0], [0, 0, 1.0]], 0.35)
    struck = strike(impact.problem("poisson"))
    assert struck.course(0) == (2, 0)
    assert struck.after[1:] == pytest.approx([0.0, 0.0], abs=1e-14)
    assert struck.impulses == pytest.approx(in_small_steps(impact, "poisson", 5e-4), abs=2e-3)
    assert impact.missed(struck) < 1e-13


# --- what holds both ways ---------------------------------------------------------------------------------------------


def test_a_row_declared_twice_changes_no_speeds_and_is_told() -> None:
    impact = random_impact(np.random.default_rng(3), 1, both_ways=1)
    twice = Impact(impact.M, impact.u)
    for row in (impact.rows[0], 3.0 * impact.rows[0]):
        twice.both_ways(row)
    twice.contact(impact.rows[1], impact.e[1], [impact.rows[2]], 0.4)
    once = Impact(impact.M, impact.u)
    once.both_ways(impact.rows[0])
    once.contact(impact.rows[1], impact.e[1], [impact.rows[2]], 0.4)
    a, b = strike(twice.problem("poisson")), strike(once.problem("poisson"))
    assert a.x == pytest.approx(b.x, abs=1e-13 * float(np.abs(b.x).max()))
    assert (a.not_unique, b.not_unique) == ((0, 1), ())
    assert a.impulses[0] + 3.0 * a.impulses[1] == pytest.approx(b.impulses[0], rel=1e-12)


def test_an_apparent_mass_of_nearly_dependent_rows_keeps_its_digits() -> None:
    """A row holds all but 1e-7 of a contact's normal: the impulse is 1e14 times larger, with the digits of 1e-7."""
    little = 1e-7
    impact = Impact(np.eye(2), np.array([0.0, -1.0]))
    impact.both_ways([1.0, 0.0])
    impact.contact([1.0, little], 0.5)
    struck = strike(impact.problem())
    assert struck.impulses[1] == pytest.approx(1.5 / little, rel=1e-13)
    assert struck.after[1] == pytest.approx(0.5 * little, rel=1e-6)


def test_a_contact_that_nothing_can_move_is_an_error() -> None:
    impact = Impact(np.eye(2), np.array([-1.0, 0.0]))
    impact.both_ways([1.0, 0.0])
    impact.contact([1.0, 0.0], 0.5)
    problem = impact.problem()
    problem.rows.right[0] = 0.0  # as if a drive moved it
    with pytest.raises(NoSolutionError, match="row 1 closes"):
        strike(problem)


@pytest.mark.parametrize("law", LAWS)
def test_a_joint_that_rubs_takes_part_by_what_presses_it(law: str) -> None:
    """A slider on a rail is struck at 45 degrees: the rail takes p, and mu p holds it back: 3 = (1 + mu) p at e = 0."""
    mu = 0.2
    for e in (0.0, 0.5):
        impact = Impact(np.eye(2), np.array([3.0, 0.0]))
        impact.both_ways([0.0, 1.0])
        impact.contact([-1.0, -1.0], e, [[1.0, 0.0]], mu)
        impact.parts[0] = FrictionLaw((2,), (0,), mu, mu)
        struck = strike(impact.problem(law))
        # It slips forward until it stands; from there the contact pushes it back against friction.
        p, q = 3.0 / (1.0 + mu), {"newton": 3.0 * e, "poisson": 3.0 * e * (1 - mu) / (1 + mu)}
        back = q.get(law, 3.0 * e * math.sqrt((1 - mu) / (1 + mu)))
        total = p + back / (1.0 - mu)
        assert struck.impulses == pytest.approx([total, total, -mu * p + mu * (total - p)], rel=1e-12)
        assert struck.after[1] == pytest.approx(back, abs=1e-12)
        assert struck.course(0) == ((1,) if e == 0.0 else (1, -1))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("tangents", [1, 2])
def test_a_row_that_only_tells_a_joints_impulse_changes_nothing(law: str, tangents: int) -> None:
    """It defines its multiplier, z = A x, and exerts nothing: eliminated otherwise, to the same speeds."""
    impact = with_friction(random_impact(np.random.default_rng(5), 1, tangents=tangents, both_ways=1))
    plain = impact.problem(law)
    rows, more = plain.rows, np.random.default_rng(6).normal(size=plain.rows.matrix.shape[1])
    coupling = np.zeros((len(rows.laws) + 1,) * 2)
    coupling[-1, -1] = -1.0
    told = replace(
        plain,
        rows=LawProblem(
            np.vstack([rows.matrix, more]), np.vstack([rows.exerted, np.zeros_like(more)]), coupling,
            np.append(rows.right, 0.0), (*rows.laws, Equality()), rows.parts,
        ),
        restitution=np.append(plain.restitution, 0.0),
    )  # fmt: skip
    a, b = strike(told), strike(plain)
    assert a.x == pytest.approx(b.x, rel=1e-11)
    assert a.impulses == pytest.approx([*b.impulses, more @ b.x], rel=1e-10)
    assert a.lost == pytest.approx([*b.lost, 0.0], abs=1e-11 * float(np.abs(b.lost).max()))


def test_wrong_coefficients_are_refused() -> None:
    with pytest.raises(InputError, match=r"between 0 and 1, not 1\.2"):
        strike(sphere([0.0, -1.0, 0.0], 0.0, 1.2).problem())
