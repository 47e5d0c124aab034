"""The rows of ropes: one for each run between wheels that turn with the rope."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.constraints import Pulley, Rope, Roughness
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.start_constants import (
    Measure,
    RopeLength,
    RopeSide,
    TangentDirection,
    WrapAngle,
)
from multibody_sym.model.resolution.references import References
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, negate


def run_names(system: System, name: str) -> list[str]:
    """Return the names of a rope's rows: its own, or with the number of each run between wheels that it grips."""
    rope = system.constraints[name]
    assert isinstance(rope, Rope)
    count = 1 + sum(step in system.pulleys and system.pulleys[step].grips for step in rope.route[1:-1])
    return [name] if count == 1 else [f"{name}.{k}" for k in range(1, count + 1)]


def tension_names(system: System, name: str) -> list[str]:
    """Return what each tension of a rope is asked by: its name, or with numbers between wheels on which it rubs too."""
    rope = system.constraints[name]
    assert isinstance(rope, Rope)
    over = [system.pulleys[step] for step in rope.route[1:-1] if step in system.pulleys]
    count = 1 + sum(pulley.grips or pulley.rough is not None for pulley in over)
    return [name] if count == 1 else [f"{name}.{k}" for k in range(1, count + 1)]


def rope_measures(references: References, name: str, rope: Rope) -> Iterator[tuple[str, Measure]]:
    """Yield what the start measures of a rope, by the names under which rows ask for it."""
    runs = _runs(references, name, rope)
    for place in (place for run in runs for place in run if _bends(rope, place)):
        yield _of_side(name, place.step), RopeSide(name, place.step)
    for row, run in zip(run_names(references.system, name), runs, strict=True):
        grips = [end for end, place in ((0, run[0]), (1, run[-1])) if place.pulley and place.pulley.turns]
        if grips or rope.length is None:
            yield row, RopeLength(row, winds=bool(grips))
        for end in grips:
            yield _of_end(row, end), TangentDirection(row, end)
        for place in _rough(run):
            yield f"{row}.{place.step}", WrapAngle(f"{row}.{place.step}")


def rope_rows(references: References, name: str, rope: Rope) -> list[RopeRow]:
    """Return the rows of a rope. Raises ModelError for paths that no rope can take, with the place."""
    names, runs = run_names(references.system, name), _runs(references, name, rope)
    _verify_length(rope, len(runs), [*runs[0], *runs[-1]])
    made = []
    number = 1
    for row, run in zip(names, runs, strict=True):
        path = [replace(place.bend, grip=None) for place in run]
        for end, k in ((0, 0), (1, -1)):
            pulley = run[k].pulley
            if pulley is not None and pulley.turns:
                grip = run[k].bend.grip
                assert grip is not None
                path[k] = replace(path[k], grip=replace(grip, start=references.constants[_of_end(row, end)].slot))
        length = references.constants[row].slot if row in references.constants else rope.length
        assert length is not None
        several = len(tension_names(references.system, name)) > 1
        rough = _rough(run)
        rubs = tuple(f"{row}.{place.step}" for place in rough)
        run_number, label = number if several else 0, rope.label or ""
        made.append(RopeRow(row, tuple(path), length, name, run_number, rubs=rubs, label=label))
        number += 1 + len(rough)
    return made


def rope_slips(references: References, row: RopeRow) -> Iterator[tuple[str, RopeSlipRow, Roughness]]:
    """Yield the wheels on which a run of rope rubs: what their friction is called, the row of the slip, how rough."""
    pulleys = references.system.pulleys
    for k in (k for k, bend in enumerate(row.path[1:-1], 1) if bend.rough):
        pulley = row.path[k].pulley
        slip, roughness = f"{row.name}.{pulley}", pulleys[pulley].rough
        assert roughness is not None
        ropes = (element for element in references.system.constraints.values() if isinstance(element, Rope))
        alone = sum(pulley in element.route for element in ropes) == 1
        wrap = references.constants[slip].slot
        yield (pulley if alone else slip), RopeSlipRow(slip, row, k, wrap), roughness


def _rough(run: Sequence[_Place]) -> list[_Place]:
    return [place for place in run[1:-1] if place.pulley is not None and place.pulley.rough is not None]


def _bends(rope: Rope, place: _Place) -> bool:
    """Return whether the bend alone tells on which side of a wheel the rope runs."""
    return place.bend.radius.shadow != 0 and place.bend.beside is not None and _word(rope, place.step) is None


def _word(rope: Rope, step: str) -> str | None:
    return rope.wrap.get(step, rope.wrap.get(""))


def _of_end(row: str, end: int) -> str:
    return f"{row} at end {end + 1}"


def _of_side(rope: str, step: str) -> str:
    return f"{rope} at {step}"


def _verify_length(rope: Rope, runs: int, ends: Sequence[_Place]) -> None:
    if rope.length is not None and (runs > 1 or any(p.pulley and p.pulley.turns for p in ends)):
        raise ModelError(
            "what lies on wheels that turn counts to no length that could be given: leave length out, and place the "
            "bodies by their initial positions",
            number="M110",
        ).under("length")


# --- the path -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Place:
    """A place on a path: what the file calls it, the pulley that it is (None: a point), and the bend there."""

    step: str
    pulley: Pulley | None
    bend: Bend


def _runs(references: References, name: str, rope: Rope) -> list[list[_Place]]:
    """Return the path cut at each wheel between its ends that turns with the rope."""
    places = _places(references, name, rope)
    cuts = [k for k, p in enumerate(places[1:-1], 1) if p.pulley is not None and p.pulley.grips]
    ends = [0, *cuts, len(places) - 1]
    return [places[first : last + 1] for first, last in pairwise(ends)]


def _places(references: References, name: str, rope: Rope) -> list[_Place]:
    """Return the places of a path, with sides as the file gives them, or as the start measures them."""
    route, pulleys = rope.route, references.system.pulleys
    _verify_route(rope, pulleys)
    bends = [_bend(index, step, references) for index, step in enumerate(route)]
    belt = route[0] == route[-1] and route[0] in pulleys
    made = []
    for k, (step, bend) in enumerate(zip(route, bends, strict=True)):
        pulley = pulleys.get(step)
        end = k in (0, len(route) - 1)
        near = (bends[k - 1], bends[(k + 1) % len(bends)]) if not end else (bends[-2], bends[1])
        beside = (near[0].at, near[1].at) if pulley is not None and (belt or not end) else None
        word = _word(rope, step) if pulley is not None else None
        if pulley is not None and end and not belt and word is None:
            raise _which_side(step, route[1] if k == 0 else route[-2], first=k == 0).under("path")
        constant = references.constants.get(_of_side(name, step))
        measured = ZERO if constant is None else constant.slot
        side = measured if word is None else ONE if word == "+" else negate(ONE)
        turns = rope.turns.get(step, rope.turns.get("", 0)) if pulley is not None else 0
        made.append(_Place(step, pulley, replace(bend, side=side, beside=beside, turns=turns)))
    return made


def _which_side(drum: str, near: str, *, first: bool) -> ModelError:
    """Return the error that shows both readings of a drum at the first or last end of a path."""
    right, left = ('"-"', '"+"') if first else ('"+"', '"-"')
    return ModelError(
        f"on which side the rope leaves drum {drum} is not told. Seen against the drum's axis with {near} straight "
        f"below it, a rope with wrap: {right} hangs down on the right, with wrap: {left} on the left (+ runs "
        "counter-clockwise in the order of the path)",
        number="M115",
    )


def _verify_route(rope: Rope, pulleys: Mapping[str, Pulley]) -> None:
    """Raise ModelError for drums that are none, pulleys at an end or twice on a path, and words for other wheels."""
    route = rope.route
    for k, drum in enumerate(rope.wind):
        with at("wind", k):
            if drum not in pulleys:
                raise ModelError(f"no pulley is called {drum!r}", number="M106", word=drum, known=pulleys)
            if not pulleys[drum].turns:
                raise ModelError(
                    f"{drum} stands at a point and turns nothing; a drum is a pulley with body and radius",
                    number="M115",
                )
            if drum in route[1:-1]:
                raise ModelError(
                    f"{drum} stands between the ends of the path; a rope winds on a drum at its end", number="M115"
                )
    belt = route[0] == route[-1] and route[0] in pulleys and pulleys[route[0]].turns
    for k in (0, len(route) - 1):
        if route[k] in pulleys and not belt and route[k] not in rope.wind:
            with at("path", k):
                raise ModelError(
                    f"the rope ends on pulley {route[k]} and is fastened to nothing there: name a body's point, or, if "
                    f"it winds on it, write wind: {route[k]}",
                    number="M115",
                )
    for k, step in enumerate(route[:-1] if belt else route):
        if step in pulleys and step in route[:k]:
            with at("path", k):
                raise ModelError(
                    f"the rope runs over pulley {step} twice; declare a second pulley there", number="M115"
                )
    for word in ("wrap", "turns"):
        for name in getattr(rope, word):
            if name and (name not in pulleys or name not in route):
                over = [step for step in route if step in pulleys]
                with at(word, name):
                    raise ModelError(
                        f"the rope does not run over a pulley {name!r}", number="M106", word=name, known=over
                    )


def _bend(index: int, step: str, references: References) -> Bend:
    if step in references.pulleys:
        return references.pulleys[step]
    with at("path", index):
        try:
            return Bend(references.marker(step), ZERO, (ZERO, ZERO, ONE))
        except ModelError as error:
            if not references.pulleys or not error.known or "." in step:
                raise
            told = f"no body or pulley is called {step!r}"
            raise ModelError(told, number="M106", word=step, known=[*references.pulleys, *error.known]) from error
