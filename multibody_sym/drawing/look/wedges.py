"""Wedges: masses without a size on which another body slides up a slope."""

from __future__ import annotations

import numpy as np

from multibody_sym.drawing.look.settle import STEEPEST
from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Rail
from multibody_sym.scene.items import Item

LEVEL = 0.05
"""The slope up to which something is drawn as level."""


def slope_of(sheet: Sheet, item: Item) -> Floats | None:
    """Return the direction on the page of a rail on a block, on which another body slides."""
    for other in sheet.touched.get(item.body, ()):
        if isinstance(other.form, Rail) and other.bodies and other.bodies[0] == item.body:
            slope = unit2(sheet.way(item.body, other.form.axis))
            return slope if abs(float(slope @ left(sheet.down))) >= STEEPEST else None
    return None


def wedge_under(sheet: Sheet, item: Item, at: Floats, slope: Floats) -> Floats:
    """Return the corners (3, 2) of a wedge below a slope through a place, as long as what is fixed to it and slides."""
    up = slope if float(slope @ sheet.down) < 0.0 else -slope
    bodies = {i.bodies[1] for i in sheet.touched.get(item.body, ()) if isinstance(i.form, Rail) and len(i.bodies) > 1}
    anchors = [anchor for strand in sheet.scene.strands for anchor in strand.anchors if anchor.body == item.body]
    ways = [float((sheet.at(anchor.body, anchor.point) - at) @ up) for anchor in anchors]
    ways += [float((sheet.at(body, (0.0, 0.0, 0.0)) - at) @ up) for body in bodies]
    low, high = at + min([-36.0, *(way - 18.0 for way in ways)]) * up, at + max([36.0, *(w + 20.0 for w in ways)]) * up
    return np.array([low, high, high + sheet.down * float((low - high) @ sheet.down)])
