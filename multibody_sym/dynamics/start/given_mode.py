"""The mode that words give: which elements touch, stick or slide, in place of the states that the laws allow.

In: a mechanism in no mode, its start, and words such as `{floor: stick}`. Out: a Mode. Reactions of joints press with
the signs that they have at the start in this mode.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from multibody_sym.dynamics.contact.contact_problem import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import mechanism_in_mode, start_in_mode
from multibody_sym.errors import InputError, NoSolutionError, at
from multibody_sym.mechanics.law_elements import ACTIVE, ALONG_VELOCITY, INACTIVE, LawElement, Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import possible_words
from multibody_sym.mechanics.motion import state_of
from multibody_sym.model.state_words import STRIKES, VERBS

_PASSES: Final = 8
"""Friction turns reactions by little: their signs settle at once, or not at all."""
_SLIPS: Final = {"+": 1, "-": -1}


def given_mode(declared: Mechanism, begin: Start, words: Mapping[str, str]) -> Mode:
    """Return the mode with these words; elements without one are open, and friction without one sticks.

    Raises InputError for unknown names and words, NoSolutionError where reactions of joints have no consistent signs.
    """
    known = possible_words(declared.one_way)
    for name, word in words.items():
        with at("mode"):
            if name not in known:
                raise InputError(f"{name!r} is nothing that holds or lets go", number="M106", word=name, known=known)
            states = sorted(known[name].difference(VERBS[STRIKES]))
            if word not in states:
                raise InputError(f"{name} is no {word!r}; it may be {', '.join(states)}", number="M106")
    sides, slips = dict[str, int](), dict[str, int]()
    for element in declared.one_way:
        acts = not element.unilateral or any(
            words.get(name, element.words[1]) != element.words[1] for name in (element.name, element.group)
        )
        sides[element.name] = ACTIVE if acts else INACTIVE
        for part in element.frictions if acts else ():
            word = words.get(part.name, "")
            if word.startswith(("slide", "slip")):
                slips[part.name] = _SLIPS.get(word[-1], ALONG_VELOCITY)
    return _with_sides(declared.relative or declared, begin, Mode(sides, slips))


def _with_sides(base: Mechanism, begin: Start, mode: Mode) -> Mode:
    """Return a mode with the signs of the reactions that press at the start."""
    rubbing = [x for x in base.one_way if not x.unilateral]
    if not rubbing:
        return mode
    for _ in range(_PASSES):
        found = _sides_at(base, begin, mode, rubbing)
        if found == mode.sides:
            return mode
        mode = replace(mode, sides=found)
    raise NoSolutionError(
        f"the reaction in {rubbing[0].joint or rubbing[0].name} has no sign that its friction leaves as it is in this "
        "mode; choose another one",
        number="N107",
    )


def _sides_at(base: Mechanism, begin: Start, mode: Mode, rubbing: list[LawElement]) -> dict[str, int]:
    """Return the sides of a mode, those of joints as their reactions are at the start."""
    mechanism = mechanism_in_mode(base, mode)
    there = start_in_mode(mechanism, base, begin)
    state = state_of(mechanism, float, 0.0, there.q, there.u, there.parameters)
    forces = forward_dynamics(tree_dynamics_of(mechanism, state)).multipliers.tolist()
    signs = {row.name: -1 if force < 0.0 else 1 for row, force in zip(mechanism.rows, forces, strict=True)}
    sides = dict(mode.sides)
    for element in rubbing:
        sides |= {row.name: signs[row.name] for row in element.normals if row.name in signs}
    return sides
