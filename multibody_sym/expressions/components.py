"""The names of the components of forces: of what joints, contacts, stops and friction exert."""

from __future__ import annotations

from typing import Final

COMPONENTS: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""The components of a joint's reaction: force and moment."""
_NUMBERED: Final = tuple(f"{word}{k}" for word in ("friction", "rolling") for k in ("", "_1", "_2", "_3"))
AT: Final = ("at_x", "at_y", "at_z")
"""The coordinates of the place at which a contact presses."""
FORCE_NAMES: Final = (*COMPONENTS, "normal", "force", *_NUMBERED, *AT)
"""All that `reaction(.., component)` takes, each of which is a function of its own too: `fx(hinge)`."""
