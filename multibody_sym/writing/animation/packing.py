"""Numbers for a page: columns as int16 between their ends, in base64; names and numbers as JSON that ends no script."""

from __future__ import annotations

import base64
import json
from typing import Any, Final

import numpy as np

from multibody_sym.numerics.arrays import Floats

_LARGEST: Final = 32767
_NO_NUMBER: Final = -32768


def packed(rows: Floats) -> dict[str, Any]:
    """Return numbers (m, n) as what `unpack` of animation.js reads: to a 65,534th of each column's range.

    What is not finite becomes no number.
    """
    known = np.isfinite(rows)
    low = np.min(rows, axis=0, where=known, initial=np.inf)
    high = np.max(rows, axis=0, where=known, initial=-np.inf)
    low, high = (np.where(np.isfinite(ends), ends, 0.0) for ends in (low, high))
    span = np.where(high > low, high - low, 1.0)
    parts = np.where(known, (np.where(known, rows, low) - low) / span, 0.0)
    whole = np.where(known, np.rint(parts * 2 * _LARGEST) - _LARGEST, _NO_NUMBER).astype("<i2")
    data = base64.b64encode(np.ascontiguousarray(whole).tobytes()).decode("ascii")
    return {"data": data, "low": [short(x) for x in low], "high": [short(x) for x in high]}


def short(value: float) -> float:
    """Return a number as one of nine digits, which is shorter to write."""
    return float(f"{value:.9g}")


def script_json(value: Any) -> str:
    """Return JSON that may stand in a script of a page: it holds no < and no line end that a script knows."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
