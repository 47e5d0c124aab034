"""The public interface is on record: what differs from the last release is named in CHANGES.md."""

from __future__ import annotations

import public_record as record
import pytest

BEFORE = {
    "simulate": "function (system)",
    "simulate(system)": "required",
    "simulate(samples)": "= 1001",
    "Trajectory.plot": "method (path=None)",
    "multibody-sym check --json": "without a value",
    "joints type pin": "the same as revolute",
}


def test_every_difference_from_the_last_release_is_named() -> None:
    missing = record.unnamed(record.differences(record.recorded(), record.interface()), record.unreleased())
    assert not missing, record.message(missing)


def test_the_release_on_record_is_the_latest_of_the_changes() -> None:
    titles = [line.removeprefix("## ") for line in record.CHANGES.read_text().splitlines() if line.startswith("## ")]
    assert titles[:2] == ["Unreleased", record.release()]
    assert record.section(record.release()).strip()


def test_the_record_holds_what_users_write() -> None:
    names = record.interface()
    assert names["Revolute(axis)"] == "= 'z'"
    assert names["simulate(t_end)"] == "= None"
    assert names["Trajectory.energy"] == "property"
    assert names["RightSide.__call__"] == "method (t, x, parameters=None, inputs=None)"
    assert names["multibody-sym simulate --t-end"] == "T_END"
    assert names["joints type hinge"] == "the same as revolute"
    assert len(names) > 600
    assert not [how for how in names.values() if " at 0x" in how], "an address is another one in each process"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"simulate(step)": "= None"}, "`simulate` takes `step=`"),
        ({"simulate(samples)": "= 501"}, "`simulate(samples=)` is 501\n  where nothing is said"),
        ({"Trajectory.plot": "method (path=None, *, dpi=100)"}, "`Trajectory.plot` takes `dpi`"),
        ({"multibody-sym check --units": "U"}, "every\n  command takes `--units U`"),
        ({"multibody-sym check --units": "U"}, "`check --units`"),
        ({"joints type bolt": "the same as fixed"}, "joints: `bolt` is `fixed`"),
    ],
)
def test_a_change_needs_an_item_that_names_all_of_it(change: dict[str, str], named: str) -> None:
    different = record.differences(BEFORE, {**BEFORE, **change})
    assert list(different) == list(change)
    others = "\n- `simulate` is faster\n- `step`, `plot`\n- `solve --unit`\n- Trajectory\n- fixed\n- every command"
    assert record.unnamed(different, others) == different
    assert record.unnamed(different, f"{others}\n- {named}\n") == {}
    assert next(iter(different)) in record.message(different)


def test_what_is_gone_is_a_difference_too() -> None:
    for name in BEFORE:
        assert list(record.differences(BEFORE, {k: how for k, how in BEFORE.items() if k != name})) == [name]
