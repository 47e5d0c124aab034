"""Start values that are typed: each on its own, in a list with gaps, held before any that nobody typed."""

from __future__ import annotations

import math
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start import start as starting
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.mechanics.changes import with_initial

DISC = {"mass": 2, "inertia": {"Ixx": 0.1, "Iyy": 0.1, "Izz": 0.1}}


def begun(system: mbs.System) -> tuple[Start, dict[str, float]]:
    """Return the start, and its coordinates and speeds by name."""
    resolved = mbs.mechanism(system)
    begin = start(resolved)
    names = [x.name for x in (*resolved.coordinates, *resolved.speeds)]
    return begin, dict(zip(names, (*begin.q, *begin.u), strict=True))


def plate(initial: Any, zero: str = "P_x + 2*P_y + P_theta - 1") -> mbs.System:
    """Return a plate that slides and turns in a plane, tied by one row."""
    joint = mbs.Planar("ground", "plate", initial=initial)
    return mbs.System("plate", bodies={"plate": DISC}, joints={"P": joint}, constraints={"tie": mbs.Expression(zero)})


def sliders(*initial: Any) -> mbs.System:
    """Return three bodies on a line whose places a, b, c have the sum zero."""
    bodies = dict.fromkeys("ABC", DISC)
    joints = {
        name: mbs.Prismatic("ground", name, axis="x", q=name.lower(), initial=given)
        for name, given in zip("ABC", initial, strict=True)
    }
    return mbs.System("sliders", bodies=bodies, joints=joints, constraints={"tie": mbs.Expression("a + b + c")})


def test_a_gap_in_a_list_is_found_and_the_rest_is_held() -> None:
    begin, found = begun(plate({"q": [None, 0.2, 0.1], "u": [3, None, 1]}))
    assert (found["P_y"], found["P_theta"]) == (0.2, 0.1)
    assert found["P_x"] == pytest.approx(1 - 2 * 0.2 - 0.1, abs=1e-14)
    assert (found["u_P_x"], found["u_P_theta"]) == (3, 1)
    assert found["u_P_y"] == pytest.approx(-(3 + 1) / 2, abs=1e-14)
    assert set(begin.held) == {"P_y", "P_theta", "u_P_x", "u_P_theta"}
    assert set(begin.assembled) == {"P_x", "u_P_y"}


@pytest.mark.parametrize("gap", ["~", "null"])
def test_a_file_writes_a_gap_as_null(gap: str) -> None:
    text = f"""\
multibody_sym: 1
name: plate
bodies: {{plate: {{mass: 2, inertia: {{Izz: 0.1}}}}}}
joints:
  P: {{type: planar, parent: ground, child: plate, initial: {{q: [{gap}, 20 cm, 0.1], known: [{gap}, true, {gap}]}}}}
constraints: {{tie: {{type: expression, zero: P_x + 2*P_y + P_theta - 1}}}}
"""
    for system in (mbs.loads(text), mbs.loads(mbs.dumps(mbs.loads(text)))):
        resolved = mbs.mechanism(system)
        assert [(c.given, c.known) for c in resolved.coordinates] == [(False, False), (True, True), (True, False)]
        assert begun(system)[1]["P_y"] == pytest.approx(0.2, abs=1e-16)


def test_known_means_what_is_typed_and_never_a_gap() -> None:
    def known(initial: Any) -> tuple[list[bool], list[bool]]:
        resolved = mbs.mechanism(plate(initial))
        return [c.known for c in resolved.coordinates], [s.known for s in resolved.speeds]

    none = [False] * 3
    assert known({"q": [None, 0.2, None], "known": True}) == ([False, True, False], none)
    assert known({"q": [None, 0.2, None], "u": [1, None, 3], "known": True}) == (
        [False, True, False],
        [True, False, True],
    )
    assert known({"u": [1, 2, 3], "known": True}) == (none, [True] * 3)
    assert known({"known": True}) == (none, none)
    assert known({"q": [1, 2, 3], "known": [True, None, False]}) == ([True, False, False], none)
    assert known({"q": [None, 0.2, None], "known": [True, False, False]}) == (none, none)


def four_bar(crank: dict[str, Any], rocker: dict[str, Any]) -> mbs.System:
    """Return a crank-rocker (lengths 0.2, 0.5, 0.4, pivots 0.5 apart) of whose coupler nothing is typed."""
    lengths = {"crank": 0.2, "coupler": 0.5, "rocker": 0.4}
    bodies = {name: mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": [x, 0, 0]}) for name, x in lengths.items()}
    joints = {
        "A": mbs.Revolute("ground", "crank", q="crank_angle", initial=crank),
        "B": mbs.Revolute("crank.end", "coupler", q="coupler_angle"),
        "D": mbs.Revolute("ground.pivot", "rocker", q="rocker_angle", initial=rocker),
        "C": mbs.Revolute("coupler.end", "rocker.end"),
    }
    ground = mbs.Body(points={"pivot": [0.5, 0, 0]})
    return mbs.System("four_bar", bodies={"ground": ground, **bodies}, joints=joints)


@pytest.mark.parametrize(
    ("crank", "rocker"),
    [
        ({"q": None, "u": 10, "known": True}, {"q": "95 deg"}),
        ({"q": None, "known": [True]}, {"q": "95 deg", "known": True}),
        ({"known": True}, {"q": "95 deg"}),
    ],
)
@pytest.mark.parametrize("at_call", [False, True])
def test_a_marked_gap_is_found_from_what_is_typed(crank: Any, rocker: Any, at_call: bool) -> None:
    """The rocker stays at 95 degrees, from which the law of cosines has the crank; at 0 it would be 90 degrees."""
    system = four_bar(crank, rocker)
    if at_call:
        system = with_initial(four_bar({**crank, "q": "60 deg"}, rocker), {"crank_angle": None})
    begin, found = begun(system)
    angle = math.radians(95)
    assert found["rocker_angle"] == angle
    assert begin.shifts == {}
    x, y = 0.5 + 0.4 * math.cos(angle), 0.4 * math.sin(angle)
    across = math.acos((0.2**2 + x**2 + y**2 - 0.5**2) / (2 * 0.2 * math.hypot(x, y)))
    assert min(abs(found["crank_angle"] - math.atan2(y, x) - side * across) for side in (1, -1)) < 1e-12
    assert ("u_crank_angle" in begin.held) == ("u" in crank)


def test_a_typed_value_is_held_beside_known_ones_while_others_are_not_typed() -> None:
    """a known, b typed, c not: c = -(a + b) closes the row, so that nothing typed need change."""
    begin, found = begun(sliders({"q": 1, "u": 2, "known": True}, {"q": 0.5, "u": 0.25}, None))
    assert [found[name] for name in ("a", "b", "u_a", "u_b")] == [1, 0.5, 2, 0.25]
    assert found["c"] == pytest.approx(-1.5, abs=1e-14)
    assert found["u_c"] == pytest.approx(-2.25, abs=1e-14)
    assert begin.shifts == {}


def test_a_typed_value_that_known_ones_leave_no_room_for_is_a_guess() -> None:
    """a and c known: b = -(a + c), whatever was typed, and the change is told."""
    begin, found = begun(sliders({"q": 1, "known": True}, {"q": 0.5}, {"q": 0.5, "known": True}))
    assert (found["a"], found["c"]) == (1, 0.5)
    assert found["b"] == pytest.approx(-1.5, abs=1e-14)
    assert begin.shifts == {"b": pytest.approx(-2.0)}


def test_a_quaternion_has_no_gaps() -> None:
    def ball(**initial: Any) -> mbs.System:
        joint = mbs.Free("ground", "plate", initial=initial)
        return mbs.System("ball", bodies={"plate": DISC}, joints={"F": joint})

    _, found = begun(ball(q=[None, 1, None, None, None, None, None], u=[None, 2, None, 3, None, 4]))
    assert [found[f"F_{x}"] for x in ("x", "y", "z", "qw", "wx", "wy", "wz")] == [0, 1, 0, 1, 3, 0, 4]
    assert [found[f"u_F_{x}"] for x in "xyz"] == [0, 2, 0]
    with pytest.raises(mbs.ModelError, match=r"quaternion.*all four or none") as error:
        ball(q=[0, 0, 0, 1, None, 0, 0])
    assert error.value.where.path[-2:] == ("initial", "q")
    with pytest.raises(mbs.ModelError, match=r"quaternion.*all four or none") as error:
        ball(q=[0, 0, 0, 1, 0, 0, 0], known=[True, True, True, True, False, True, True])
    assert error.value.where.path[-2:] == ("initial", "known")


def test_a_list_of_the_wrong_length_is_told_with_what_a_gap_is() -> None:
    for key in ("q", "u", "known"):
        with pytest.raises(mbs.ModelError, match=r"needs 3 .* null \(None\)") as error:
            plate({key: [1 if key != "known" else True, None]})
        assert error.value.where.path[-2:] == ("initial", key)
    with pytest.raises(mbs.ModelError, match="expected true or false"):
        plate({"known": [True, "perhaps", None]})


@pytest.mark.parametrize("guess", [60, 80, 120])
def test_a_typed_angle_that_does_not_close_moves_to_the_nearest_one_that_does(guess: float) -> None:
    """By hand: at 90 deg of the crank the rocker is parallel to it, or at 233 deg: tan(gamma/2) = 1, -2."""
    bar, freedom = mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": ["a", 0, 0]}), {"motion": "pi/2 + 10*t"}
    rod = mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": ["3*a", 0, 0]})
    system = mbs.System(
        "four bar",
        parameters={"a": 0.1},
        bodies={"ground": mbs.Body(points={"D": ["3*a", 0, 0]}), "AB": bar, "BC": rod, "CD": bar},
        joints={
            "A": mbs.Revolute("ground", "AB", **freedom),
            "B": mbs.Revolute("AB.end", "BC", q="beta"),
            "D": mbs.Revolute("ground.D", "CD", q="gamma", initial={"q": f"{guess} deg"}),
            "C": mbs.Revolute("BC.end", "CD.end", cut=True),
        },
    )
    _, values = begun(system)
    assert values["gamma"] == pytest.approx(math.pi / 2, abs=1e-12)


def test_what_nobody_gave_is_guessed_once_a_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each guess searches all around: one for every value that was tried held took four fifths of a start's time."""
    guessed: list[int] = []
    of_assembly = starting.best_guess
    monkeypatch.setattr(starting, "best_guess", lambda *of: guessed.append(1) or of_assembly(*of))
    rod = mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": [1, 0, 0]})
    starts = [{"q": 1.0}, {"q": 0.1}, {}]
    joints: dict[str, mbs.Joint] = {
        f"J{k}": mbs.Revolute(parent, f"rod{k}", q=f"q{k}", initial=given)
        for k, (parent, given) in enumerate(zip(("ground", "rod0.end", "rod1.end"), starts, strict=True))
    }
    joints["C"] = mbs.Revolute("ground.far", "rod2.end", cut=True)
    bodies = {"ground": mbs.Body(points={"far": [2.9, 0, 0]}), **{f"rod{k}": rod for k in range(3)}}
    _, values = begun(mbs.System("chain", bodies=bodies, joints=joints))
    angles = [values["q0"], values["q0"] + values["q1"], values["q0"] + values["q1"] + values["q2"]]
    assert sum(map(math.cos, angles)) == pytest.approx(2.9, abs=1e-12)
    assert sum(map(math.sin, angles)) == pytest.approx(0.0, abs=1e-12)
    assert len(guessed) == 1
