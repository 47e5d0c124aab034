"""Where bodies touch on the page: at a point, or where something round is nearest to a face or to something round."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.pictures.marks.sheet import Sheet, unit2
from multibody_sym.pictures.page.free_space import distances
from multibody_sym.pictures.scene.items import Block, Disc, Face, Item, Polyline, Sphere, Symbol
from multibody_sym.scalars.arrays import Floats

_NEAR: Final = 4.0
_SURFACE: Final = 4
"""How many names lead to a surface: bodies, the body, surfaces, its own."""


def touching_place(sheet: Sheet, item: Item, symbol: Symbol) -> Floats | None:
    """Return where two bodies of a contact touch (2), None where their forms do not tell or they are apart."""
    if len(item.bodies) != 2:
        return None
    first, second = (_parts(sheet, item, k) for k in (0, 1))
    for one, two in ((first, second), (second, first)):
        for a in one:
            for b in two:
                found = _nearest(sheet, a, b)
                if found is not None:
                    return found
    at = sheet.at(item.body, symbol.at) - sheet.settled.bodies.get(item.body, np.zeros(2))
    faces = [(i.body, i.form) for i in second if isinstance(i.form, Face)]
    heights = [float((at - sheet.at(body, face.through)) @ sheet.way(body, face.normal)) for body, face in faces]
    if faces and min(map(abs, heights)) >= _NEAR:
        return None
    return at if any(symbol.at) or any(isinstance(i.form, (Face, Polyline)) for i in (*first, *second)) else None


def _parts(sheet: Sheet, item: Item, end: int) -> list[Item]:
    """Return what is seen of one of both ends: the surface that is named, else all of the body."""
    every = sheet.touched.get(item.bodies[end], [])
    named = item.touching[end] if item.touching else ""
    surfaces = [each for each in every if len(each.path) == 4 and named == f"{each.path[1]}.{each.path[3]}"]
    return surfaces or every


def _nearest(sheet: Sheet, a: Item, b: Item) -> Floats | None:
    """Return where something round touches a face or something round."""
    if isinstance(a.form, Block) and isinstance(b.form, Face):
        return _lowest(sheet, a, a.form, b, b.form)
    if isinstance(a.form, Polyline) and isinstance(b.form, Face) and a.form.closed and len(a.path) == _SURFACE:
        return _lowest(sheet, a, a.form, b, b.form)
    if not isinstance(a.form, (Disc, Sphere)):
        return None
    centre, radius = sheet.at(a.body, a.form.centre), a.form.radius * sheet.projection.scale
    if isinstance(b.form, Face) and not sheet.flat:
        return _rim_on_face(sheet, a, b)
    if isinstance(b.form, Face):
        normal = sheet.way(b.body, b.form.normal)
        apart = float((centre - sheet.at(b.body, b.form.through)) @ normal)
        near = abs(abs(apart) - radius) < _NEAR and float(np.linalg.norm(normal)) > 0.99
        return centre - radius * normal if near else None
    if isinstance(b.form, (Disc, Sphere)):
        other, size = sheet.at(b.body, b.form.centre), b.form.radius * sheet.projection.scale
        way, apart = unit2(other - centre), float(np.linalg.norm(other - centre))
        if abs(apart - radius - size) < _NEAR:
            return centre + radius * way
        if apart > 1.0 and abs(apart - abs(radius - size)) < _NEAR:
            return centre - radius * way if size > radius else centre + radius * way
    return _on_curve(sheet, centre, radius, b) if isinstance(b.form, Polyline) and sheet.flat else None


def _on_curve(sheet: Sheet, centre: Floats, radius: float, item: Item) -> Floats | None:
    """Return the place of a curve that is nearest to the middle of something round, None if that does not touch."""
    points = sheet.page(item.body, item.form.bounds)
    lines = np.hstack((points[:-1], points[1:]))
    line = lines[int(np.argmin(distances(centre[None], lines)[0]))]
    along = line[2:] - line[:2]
    part = float((centre - line[:2]) @ along) / max(float(along @ along), 1e-12)
    place = line[:2] + np.clip(part, 0.0, 1.0) * along
    return place if abs(float(np.linalg.norm(place - centre)) - radius) < _NEAR else None


def _rim_on_face(sheet: Sheet, a: Item, b: Item) -> Floats | None:
    """Return where a ball, or the rim of a disc, is nearest to a plane in space, None where it is not near."""
    assert isinstance(a.form, (Disc, Sphere))
    assert isinstance(b.form, Face)
    pose = sheet.placed.world
    centre, through = pose(a.body, np.array([a.form.centre]))[0], pose(b.body, np.array([b.form.through]))[0]
    normal = sheet.placed.turned(b.body, b.form.normal)
    down = -normal if float((centre - through) @ normal) > 0.0 else normal
    if isinstance(a.form, Disc):
        axis = sheet.placed.turned(a.body, a.form.axis)
        down = down - float(down @ axis) * axis
    size = float(np.linalg.norm(down))
    if size < 1e-6:
        return None
    place = centre + a.form.radius * down / size
    near = abs(float((place - through) @ normal)) * sheet.projection.scale < _NEAR
    return np.asarray(sheet.projection.page(place)) if near else None


def _lowest(sheet: Sheet, a: Item, box: Block | Polyline, b: Item, face: Face) -> Floats | None:
    """Return the middle of what of a box or an outline is nearest to a face, None if it is not near."""
    normal, corners = sheet.way(b.body, face.normal), sheet.page(a.body, box.bounds)
    heights = (corners - sheet.at(b.body, face.through)) @ normal
    low = float(heights.min())
    return np.asarray(corners[heights < low + 1.0].mean(axis=0)) if abs(low) < _NEAR else None
