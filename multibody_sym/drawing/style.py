"""Pens, colours, sizes and layers of pictures, in one place: points of a page (72 to the inch)."""

from __future__ import annotations

from typing import Final

from multibody_sym.drawing.picture import Pen

INK: Final = Pen(0.9)
"""Outlines of bodies and symbols."""
BOLD: Final = Pen(1.4)
"""What stands still: faces of ground."""
THIN: Final = Pen(0.5)
"""Dimension lines, extension lines, leaders, axes of angles."""
HIDDEN: Final = Pen(0.5, dash=(3.0, 2.0))
"""What lies behind or does not exist as a thing: paths, lines of reference."""
AXIS: Final = Pen(0.5, dash=(7.0, 2.0, 1.5, 2.0))
"""Axes of rotation and symmetry."""
ROPE: Final = Pen(1.1, "#5b3a1e")
SPRING: Final = Pen(0.9)
FORCE: Final = Pen(1.3, "#b01217")
REACTION: Final = Pen(1.3, "#0b5394")
MOTION: Final = Pen(0.9, "#1d6b2f")
"""Prescribed motions, coordinates with their directions."""
MARKED: Final = Pen(1.6, "#d05a00")
"""What a question singles out: redundant rows, the place of an error."""

BODY: Final = "#e4e7eb"
"""Fill of bodies."""
DARK: Final = "#c3c9d1"
"""Fill of bodies on others, such as blocks of sliders."""
PAPER: Final = "#ffffff"
BLACK: Final = "#000000"

TYPE: Final = 10.0
"""Size of labels; their subscripts are of 8 pt."""
PIN: Final = 2.6
"""Radius of a joint's pin."""
ROD: Final = 6.0
"""Width of a rod or link."""
DOT: Final = 2.2
"""Radius of a point or a particle that has no size."""
BLOCK: Final = (20.0, 12.0)
"""Length and height of a slider's block that has no size."""
SUPPORT: Final = 12.0
"""Height of the triangle under a pivot on ground."""

LAYER_GROUND, LAYER_BODY, LAYER_STRAND, LAYER_JOINT, LAYER_ARROW, LAYER_TEXT = range(6)
"""What hides what in a plane picture; in space depth decides among bodies, strands and joints."""
