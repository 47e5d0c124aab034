"""`check`: what it finds in good models and bad ones, as an object and as text."""

from __future__ import annotations

import json

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.documents.solution import check_text
from multibody_sym.errors import ModelError
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Expression, PrescribedMotion, Pulley, Rope
from multibody_sym.model.joints import Fixed, Initial, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System

PENDULUM = {
    "gravity": [0, -9.81, 0],
    "bodies": {"rod": Body(mass=1, com=[0.5, 0, 0], inertia={"Izz": 0.1})},
    "joints": {"hinge": Revolute("ground", "rod", q="phi")},
    "outputs": {"energy": "total_energy()"},
}


def system(**changes: object) -> System:
    return System("checked", **(PENDULUM | changes))


def test_a_body_that_only_rides_along_is_checked_while_it_moves() -> None:
    bodies = {"ground": Body(motion={"y": "sin(3*t)"}), "rider": Body(mass=2)}
    found = check(system(bodies=bodies, joints={"weld": Fixed("ground", "rider")}))
    assert found.degrees_of_freedom == 0
    assert found.hints == ()
    assert found.conserved == ()
    assert 0 < found.theorems["power"] < 1e-9


def test_pendulum_is_as_it_should_be() -> None:
    found = check(system())
    assert (found.degrees_of_freedom, found.rank, found.redundant, found.not_unique) == (1, 0, (), ())
    assert set(found.agreement) == set(FORMALISMS)
    assert max(found.agreement.values()) < 10
    integrals = {"impulse", "angular_impulse", "work"}
    assert set(found.theorems) == {"power", "momentum", "angular_momentum", *integrals}
    assert max(found.theorems.values()) < 1e-13
    assert found.conserved == ("total_energy()",)
    assert found.agrees
    assert found.hints == ()


def test_object_has_the_promised_keys() -> None:
    tree = json.loads(json.dumps(check(system()).as_json()))
    promised = {"degrees_of_freedom", "rank", "redundant", "not_unique", "agreement", "theorems", "hints"}
    assert promised <= set(tree)
    assert tree["redundant"] == []


def test_text_tells_what_matters() -> None:
    text = check_text(check(system(outputs={})))
    assert text.splitlines()[0].startswith("verdict: all agree (")
    assert text.splitlines()[1] == "degrees of freedom: 1"
    assert "conserved: total_energy()" in text
    assert "hint: no outputs are declared" in text


@pytest.mark.parametrize(
    ("changes", "hint"),
    [
        ({"gravity": None}, "no gravity is declared"),
        ({"outputs": {}}, "no outputs are declared"),
        ({"parameters": {"spare": 1}}, "parameter spare is not used"),
        ({"parameters": {"spare": 1, "more": 2}}, "parameters spare, more are not used"),
        ({"parameters": {"th": 1, "theta": 2}}, "formulas and figures write th and theta alike; give theta a label"),
        ({"inputs": {"tau": "sin(t)"}}, "input tau is not used"),
        ({"pulleys": {"P": Pulley("ground")}}, "no rope runs over pulley P"),
        ({"bodies": {"rod": Body(com=[0.5, 0, 0], inertia={"Izz": 1})}}, "body rod has no mass"),
    ],
)
def test_hints(changes, hint: str) -> None:
    assert [x for x in check(system(**changes)).hints if x.startswith(hint)]


def test_bodies_between_others_may_be_without_mass() -> None:
    bob = Body(mass=1, com=[1, 0, 0], inertia={"Izz": 1})
    bodies = {"arm": Body(points={"end": [1, 0, 0]}), "bob": bob}
    joints = {"A": Revolute("ground", "arm"), "B": Revolute("arm.end", "bob")}
    assert check(system(bodies=bodies, joints=joints)).hints == ()


def test_parameters_named_by_others_are_used() -> None:
    bodies = {"rod": Body(mass="m", com=[0.5, 0, 0], inertia={"Izz": 0.1})}
    assert check(system(parameters={"m": "2*k", "k": 1}, bodies=bodies)).hints == ()


def test_particle_that_may_turn_about_itself_has_no_start() -> None:
    found = check(system(bodies={"bob": Body(mass=1, com=[0, -1, 0])}, joints={"ball": Spherical("ground", "bob")}))
    assert "no inertia resists the speed ball_w" in (found.failure or "")
    assert not found.agrees
    assert any(hint.startswith("body bob has no inertia: it is a particle") for hint in found.hints)
    assert check_text(found).startswith("no motion: ")


def test_start_values_that_do_not_close_are_told_with_residuals() -> None:
    slides = {"A": Prismatic("ground", "rod", axis="x", q="x", initial=Initial(q=1, known=True))}
    found = check(system(joints=slides, constraints={"stop": Expression("x - 3")}))
    assert found.failure is not None
    assert found.failure.startswith("constraints.stop: the start values do not satisfy the constraints: stop misses by")


def test_assembled_coordinates_are_named() -> None:
    bodies = {"slide": Body(mass=1), "bob": Body(mass=1)}
    joints = {
        "A": Prismatic("ground", "slide", axis="x", q="x", initial=Initial(q=0.6)),
        "B": Prismatic("slide", "bob", axis="y", q="y"),
    }
    found = check(system(bodies=bodies, joints=joints, constraints={"rod": Distance(["ground", "bob"], 1)}))
    assert found.degrees_of_freedom == 1
    assert found.rank == 1
    assert found.held == ("x",)
    assert "y" in found.assembled
    assert "lagrange" not in found.agreement
    assert found.agrees


def test_redundant_rod_is_named_with_what_is_not_unique() -> None:
    points = {f"p{k}": [k, 0, 0] for k in range(3)}
    found = check(
        system(
            bodies={"plate": Body(mass=1, inertia={"Izz": 1}, points=points), "ground": Body(points=points)},
            joints={"j": Planar("ground", "plate", initial=Initial(q=[0.6, -0.8, 0]))},
            constraints={f"rod{k}": Distance([f"ground.p{k}", f"plate.p{k}"], 1) for k in range(3)},
        )
    )
    assert (found.degrees_of_freedom, found.rank) == (1, 2)
    assert len(found.redundant) == 1
    assert set(found.not_unique) == {"rod0", "rod1", "rod2"}
    assert "redundant constraints: rod" in check_text(found)
    assert found.agrees
    assert found.conserved == ("total_energy()",)
    assert found.hints == ()


def test_flat_four_bar_is_a_singular_position() -> None:
    bodies = {
        "crank": Body(mass=1, inertia={"Izz": 1}, points={"end": [1, 0, 0]}),
        "bar": Body(mass=1, inertia={"Izz": 1}, points={"end": [3, 0, 0]}),
        "ground": Body(points={"d": [3, 0, 0]}),
    }
    joints = {
        "A": Revolute("ground", "crank", q="a", initial=Initial(q=0)),
        "B": Revolute("crank.end", "bar", q="b", initial=Initial(q=0)),
    }
    found = check(system(bodies=bodies, joints=joints, constraints={"rocker": Distance(["ground.d", "bar.end"], 1)}))
    singular = "constraints.rocker: the start is a singular position: rocker depends on the other constraints there,"
    assert found.failure.startswith(f"{singular} or holds nothing (the rank of the constraints is 0 there and 1 near")


def test_rope_that_would_push_is_told() -> None:
    bodies = {"load": Body(mass=2), "ground": Body(points={"floor": [0, -3, 0]})}
    joints = {"A": Prismatic("ground", "load", axis="y", q="y", initial=Initial(q=-1))}
    found = check(system(bodies=bodies, joints=joints, constraints={"string": Rope(["ground.floor", "load"])}))
    assert "rope string would have to push with 19.62 N at the start: it goes slack" in found.hints


def test_a_motion_with_a_kink_is_told() -> None:
    joints = {
        "A": Prismatic("ground", "cart", axis="x", motion="where(t < 1, 0, (t - 1)^2)"),
        "B": Revolute("cart", "load"),
    }
    found = check(system(bodies={"cart": Body(mass=1), "load": Body(mass=2, com=[0, -1, 0])}, joints=joints))
    assert found.agrees
    hints = found.hints
    assert "the motion of joint A has kinks: until t_end = 10 s neither it nor its rate jumps" in hints


def test_large_systems_are_not_derived_in_closed_form() -> None:
    bodies = {f"b{k}": Body(mass=1, com=[0.5, 0, 0], inertia={"Izz": 1}, points={"end": [1, 0, 0]}) for k in range(13)}
    joints = {"j0": Revolute("ground", "b0")} | {f"j{k}": Revolute(f"b{k - 1}.end", f"b{k}") for k in range(1, 13)}
    found = check(system(bodies=bodies, joints=joints))
    assert set(found.agreement) == set(FORMALISMS) - {"lagrange", "multipliers"}
    assert "not compared, as it would take long for so many speeds: lagrange, multipliers" in found.hints


def test_contradicting_declaration_is_an_error_not_a_report() -> None:
    with pytest.raises(ModelError):
        check(system(joints={"hinge": Revolute("ground", "rood")}))


def test_constraints_that_contradict_each_other_later_on_are_the_failure() -> None:
    """x = y = sin t, and x - y = t^3/10."""
    bodies = {"a": Body(mass=1), "b": Body(mass=1)}
    joints = {"j": Prismatic("ground", "a", axis="x", q="x"), "k": Prismatic("ground", "b", axis="y", q="y")}
    constraints = {
        "one": PrescribedMotion("j", "sin(t)"),
        "other": PrescribedMotion("k", "sin(t)"),
        "both": Expression("x - y - 0.1*t^3"),
    }
    found = check(system(bodies=bodies, joints=joints, constraints=constraints))
    assert "satisfy one, other and both together" in found.failure
    assert not found.agrees


@pytest.mark.parametrize(
    ("gravity", "turn", "told"),
    [
        ([0, -9.81, 0], mbs.Turn("z", "2*t"), True),
        ([0, -9.81, 0], mbs.Turn("y", "2*t"), False),  # about the vertical: gravity is the same seen from ground
        ([0, -9.81, 0], mbs.Turn("z", "pi/6"), False),  # tilted, at rest
        ([0, 0, 0], mbs.Turn("z", "2*t"), False),
    ],
    ids=["wheel", "turntable", "tilted", "weightless"],
)
def test_ground_that_turns_leaves_gravity_where_it_is_and_that_is_told(
    gravity: list[float], turn: mbs.Turn, told: bool
) -> None:
    """The bob at rest on a turning ground weighs along -y of the world at any time: seen from ground it turns."""
    system = mbs.System(
        "turning",
        gravity=gravity,
        bodies={"ground": mbs.Body(motion=mbs.GroundMotion(turn=[turn])), "bob": mbs.Body(mass=1, com=[0, -1, 0])},
        joints={"hinge": mbs.Revolute("ground", "bob")},
    )
    hints = [hint for hint in mbs.check(system).hints if "keeps its direction among the stars" in hint]
    assert len(hints) == told
