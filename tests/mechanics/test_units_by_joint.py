"""Quantities whose unit depends on the joint they stand in: a wrong one is refused by its path, from every door."""

from __future__ import annotations

from typing import Any

import pytest

from multibody_sym.errors import InputError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Cylindrical, Initial, Limits, Prismatic, Revolute
from multibody_sym.model.system import System, system_from_tree, tree_from_system

KINDS: dict[str, dict[str, Any]] = {
    "hinge": {"type": "revolute", "q": "phi"},
    "slide": {"type": "prismatic", "axis": "x", "q": "x"},
    "screw": {"type": "screw", "axis": "z", "pitch": "1 mm", "q": "phi"},
    "sleeve": {"type": "cylindrical", "axis": "z", "q": ["z", "phi"]},
    "plane": {"type": "planar", "q": ["x", "y", "phi"]},
    "ball": {"type": "spherical"},
    "free": {"type": "free"},
}


def tree(kind: str, joint: dict[str, Any] | None = None, **sections: Any) -> dict[str, Any]:
    return {
        "multibody_sym": "1",
        "name": "one",
        "bodies": {"b": {"mass": "1", "inertia": {"Ixx": "1", "Iyy": "1", "Izz": "1"}}},
        "joints": {"j": {"parent": "ground", "child": "b", **KINDS[kind], **(joint or {})}},
        **sections,
    }


def resolved(kind: str, joint: dict[str, Any] | None = None, **sections: Any) -> Mechanism:
    return mechanism(system_from_tree(tree(kind, joint, **sections)))


def refusal(kind: str, joint: dict[str, Any] | None = None, **sections: Any) -> tuple[str, str]:
    """Return where a model is refused, and with which message."""
    with pytest.raises(InputError) as caught:
        resolved(kind, joint, **sections)
    return ".".join(map(str, caught.value.where.path)), caught.value.message


WRONG_STARTS = [
    ("hinge", {"q": "30 m"}, "q", "rad"),
    ("hinge", {"q": ["30 m"]}, "q.0", "rad"),
    ("hinge", {"q": "30 deg", "u": "5 kg"}, "u", "rad/s"),
    ("slide", {"q": "30 deg"}, "q", "m"),
    ("slide", {"q": "1 m", "u": "3 rpm"}, "u", "m/s"),
    ("screw", {"q": "3 mm"}, "q", "rad"),
    ("sleeve", {"q": ["1 deg", "1 deg"]}, "q.0", "m"),
    ("sleeve", {"q": ["~", "3 m"]}, "q.1", "rad"),
    ("plane", {"q": ["~", "3 m", "2 m"]}, "q.2", "rad"),
    ("ball", {"q": ["1 m", "0", "0", "0"]}, "q.0", "no unit"),
    ("free", {"u": ["1 m/s", "0", "0", "1 m/s", "0", "0"]}, "u.3", "rad/s"),
]


@pytest.mark.parametrize(("kind", "initial", "place", "unit"), WRONG_STARTS)
def test_a_start_value_in_another_unit_than_its_coordinates_is_refused_where_it_stands(
    kind: str, initial: dict[str, Any], place: str, unit: str
) -> None:
    path, message = refusal(kind, {"initial": initial})
    assert path == f"joints.j.initial.{place}"
    assert message.endswith(f"does not fit here: expected a quantity in {unit}")


@pytest.mark.parametrize(("kind", "initial", "_", "unit"), WRONG_STARTS[:5])
def test_python_and_the_options_of_a_call_refuse_what_a_file_does(
    kind: str, initial: dict[str, Any], _: str, unit: str
) -> None:
    declared = system_from_tree(tree(kind))
    names = {"q": KINDS[kind]["q"], "u": f"u_{KINDS[kind]['q']}"}
    given = {key: value[0] if isinstance(value, list) else value for key, value in initial.items()}
    for start in (given, Initial(**given)):
        with pytest.raises(InputError, match=f"expected a quantity in {unit}$"):
            _joint(kind, start)
    with pytest.raises(InputError, match=f"expected a quantity in {unit}$"):
        Overrides(initial={names[key]: value for key, value in given.items()}).of(declared)


def _joint(kind: str, initial: Any) -> Any:
    if kind == "hinge":
        return Revolute("ground", "b", initial=initial)
    return Prismatic("ground", "b", axis="x", initial=initial)


def test_fitting_units_pure_numbers_and_names_without_units_start_a_joint() -> None:
    parameters = {"a": "2", "l": "3 m"}
    sleeve = {"initial": {"q": ["l + 10 * a", "180 deg"], "u": ["36 km/h", "60 rpm"]}}
    found = resolved("sleeve", sleeve, parameters=parameters)
    pi = 3.141592653589793
    assert [c.initial.shadow for c in found.coordinates[1:]] == [pytest.approx(pi)]
    assert [s.initial.shadow for s in found.speeds] == [pytest.approx(10), pytest.approx(2 * pi)]
    hinge = resolved("hinge", {"initial": {"q": "a", "u": "7"}}, parameters=parameters)
    assert hinge.speeds[0].initial.shadow == 7


@pytest.mark.parametrize(
    ("kind", "joint", "path"),
    [
        ("hinge", {"initial": {"q": "2*l"}}, "initial.q"),
        ("slide", {"initial": {"u": "l"}}, "initial.u"),
        ("sleeve", {"initial": {"q": ["l", "l"]}}, "initial.q.1"),
        ("hinge", {"limits": {"lower": "-1", "upper": "l"}}, "limits.upper"),
        ("hinge", {"q": None, "motion": "l*sin(t)"}, "motion"),
        ("sleeve", {"q": ["phi"], "motion": ["l^2", "~"]}, "motion.0"),
    ],
)
def test_parameters_with_another_unit_are_refused_where_the_joint_would_take_them(
    kind: str, joint: dict[str, Any], path: str
) -> None:
    kept = {key: value for key, value in joint.items() if value is not None}
    model = tree(kind, kept, parameters={"l": "3 m"})
    if joint.get("q", "") is None:
        del model["joints"]["j"]["q"]
    with pytest.raises(InputError, match="the expression is a quantity in") as caught:
        mechanism(system_from_tree(model))
    assert ".".join(map(str, caught.value.where.path)) == f"joints.j.{path}"


@pytest.mark.parametrize(
    ("kind", "limits", "unit"),
    [
        ("slide", {"lower": "-10 kg", "upper": "20 cm"}, "m"),
        ("slide", {"upper": "20 deg"}, "m"),
        ("slide", {"velocity": "20 rpm"}, "m/s"),
        ("slide", {"effort": "3 N*m"}, "N"),
        ("hinge", {"lower": "3 cm"}, "rad"),
        ("hinge", {"velocity": "3 m/s"}, "rad/s"),
        ("screw", {"effort": "3 N"}, "N*m"),
    ],
)
def test_limits_are_in_the_units_of_the_joint(kind: str, limits: dict[str, Any], unit: str) -> None:
    path, message = refusal(kind, {"limits": limits})
    assert path == f"joints.j.limits.{next(iter(limits))}"
    assert message.endswith(f"expected a quantity in {unit}")
    with pytest.raises(InputError, match="does not fit"):
        Cylindrical("ground", "b", axis="z", limits=None, motion=["3 deg", None])
    Prismatic("ground", "b", axis="x", limits=Limits("-10 cm", "20 cm", "3 km/h", "5 kN"))


@pytest.mark.parametrize(
    ("kind", "motion", "place", "unit"),
    [("plane", ["~", "3 deg", "~"], "motion.1", "m"), ("sleeve", ["3 m", "3 m"], "motion.1", "rad")],
)
def test_prescribed_motion_is_in_the_units_of_the_joint(kind: str, motion: list[str], place: str, unit: str) -> None:
    model = tree(kind, {"motion": motion})
    del model["joints"]["j"]["q"]
    with pytest.raises(InputError, match=f"expected a quantity in {unit}$") as caught:
        system_from_tree(model)
    assert ".".join(map(str, caught.value.where.path)) == f"joints.j.{place}"


WRONG_FORCES = [
    ("slide", {"type": "torque", "value": "5 N*m"}, "value"),
    ("slide", {"type": "torque", "value": "T"}, "value"),
    ("hinge", {"type": "torque", "value": "5 N"}, "value"),
    ("sleeve", {"type": "torque", "value": "5 N*m", "freedom": "z"}, "value"),
    ("sleeve", {"type": "torque", "value": "5 N", "freedom": "u_phi"}, "value"),
    ("slide", {"type": "spring_damper", "stiffness": "5 N*m/rad"}, "stiffness"),
    ("hinge", {"type": "spring_damper", "stiffness": "5 N/m", "damping": "c"}, "stiffness"),
    ("hinge", {"type": "spring_damper", "stiffness": "1", "damping": "3 kg/s"}, "damping"),
    ("hinge", {"type": "spring_damper", "stiffness": "1", "length": "3 cm"}, "length"),
    ("hinge", {"type": "damper", "damping": "T"}, "damping"),
]


@pytest.mark.parametrize(("kind", "force", "place"), WRONG_FORCES)
def test_forces_in_a_joint_are_in_the_units_of_its_freedom(kind: str, force: dict[str, Any], place: str) -> None:
    path, message = refusal(kind, parameters={"T": "1 N*m", "c": "3"}, forces={"f": {"joint": "j", **force}})
    assert path == f"forces.f.{place}"
    assert "quantity in" in message


def test_a_force_drives_a_slide_and_a_torque_a_hinge() -> None:
    for kind, freedom, value in (("slide", None, "5 N"), ("hinge", None, "5 N*m"), ("sleeve", "z", "F")):
        force = {"type": "torque", "joint": "j", "value": value, **({"freedom": freedom} if freedom else {})}
        assert len(resolved(kind, parameters={"F": "3 N"}, forces={"f": force}).loads) == 1
    spring = {"type": "spring_damper", "joint": "j", "stiffness": "5 N/m", "damping": "3 N*s/m", "length": "3 cm"}
    assert len(resolved("slide", forces={"f": spring}).loads) == 1


def test_springs_between_points_are_in_units_of_length() -> None:
    points = {"ground": {"points": {"o": ["1", "0", "0"]}}}
    model = tree("slide", parameters={"c": "1"})
    model["bodies"] |= points
    for wrong, place in ((("5 kg", "1 m"), "stiffness"), (("c", "1 deg"), "length")):
        spring = {"type": "spring", "between": ["ground.o", "b"], "stiffness": wrong[0], "length": wrong[1]}
        with pytest.raises(InputError, match="does not fit here") as caught:
            mechanism(system_from_tree({**model, "forces": {"f": spring}}))
        assert ".".join(map(str, caught.value.where.path)) == f"forces.f.{place}"


def test_units_that_were_read_leave_nothing_behind_in_what_is_declared() -> None:
    def declared(angle: Any) -> System:
        return System("s", bodies={"b": Body(1)}, joints={"j": Revolute("ground", "b", initial={"q": angle})})

    assert declared("180 deg") == declared("pi")
    assert system_from_tree(tree_from_system(declared("180 deg"))) == declared("180 deg")


@pytest.mark.parametrize("text", ["phi''", "2*phi' + phi", "phi*180/pi"])
def test_an_output_may_have_the_name_of_the_coordinate_that_it_is_of(text: str) -> None:
    found = resolved("hinge", outputs={"phi": text}, parameters={"l": "1 m"})
    assert list(found.outputs) == ["phi"]
