"""Which constraints have a constant that is measured at the start, and the slot among the parameters that holds it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.constraints import Rolling, Rope
from multibody_sym.model.declaration.contacts import copies
from multibody_sym.model.mechanism.contact_rows import Flat
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.model.mechanism.parameters import measured_name
from multibody_sym.model.mechanism.start_constants import Measure, TangentAngle
from multibody_sym.model.resolution.contacts.skins import solid_of
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References, StartConstant
from multibody_sym.model.resolution.ropes.runs import rope_measures
from multibody_sym.model.resolution.ropes.wheels import pulley_bends
from multibody_sym.model.resolution.surface_tangents import across


def with_constants(references: References, bodies: Sequence[TreeBody]) -> References:
    """Return the references with the constants that the start measures, which follow the declared parameters."""
    references = replace(references, bodies=tuple(bodies))
    references = replace(references, pulleys=pulley_bends(references))
    measures = dict(_measures(references, bodies))
    vector = references.parameters.with_measured(measures)
    constants = {name: StartConstant(vector.slot(measured_name(name, what)), what) for name, what in measures.items()}
    return replace(references, parameters=vector, constants=constants)


def _measures(references: References, bodies: Sequence[TreeBody]) -> Iterator[tuple[str, Measure]]:
    flat = references.plane or in_plane(references.system)
    for name, element in references.system.constraints.items():
        if isinstance(element, Rope):
            with at("constraints", name):
                yield from rope_measures(references, name, element)
        if isinstance(element, Rolling) and not flat:
            yield from _angles(name, (element.on,), references, bodies)
    for _, name, contact in copies(references.system.contacts):
        if contact.tangent is None and not flat:
            yield from _angles(name, contact.between, references, bodies)


def _angles(
    name: str, ends: Sequence[str], references: References, bodies: Sequence[TreeBody]
) -> Iterator[tuple[str, Measure]]:
    """Yield the angle of the tangents on the plane that one of some ends is, if its body turns."""
    for end in ends:
        with suppress(ModelError):  # of references that name nothing, which the contact tells with its place
            for _, skin in solid_of(end, references, flat=False).skins[:1]:
                if isinstance(skin, Flat) and _turns(bodies, skin.place.body):
                    yield name, TangentAngle(skin.place, skin.normal, across(skin.normal))


def _turns(bodies: Sequence[TreeBody], index: int) -> bool:
    """Return whether a body's axes may differ from ground's: some joint between them is more than a slide."""
    while index >= 0 and bodies[index].name != GROUND:
        body = bodies[index]
        if any(step.turns for step in body.steps) or body.frame_on_parent.rotation != body.frame_on_body.rotation:
            return True
        index = body.parent
    return False
