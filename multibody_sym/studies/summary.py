"""What people read of a study when it is done."""

from __future__ import annotations

from collections import Counter
from typing import Final

import numpy as np

from multibody_sym.studies.study import Study

_MOST: Final = 24
_REASONS: Final = 5


def study_summary(study: Study) -> str:
    """Return how many runs were done, in what range their results are, and why some have none."""
    failures = study.failures
    again = "" if study.computed == len(study) else f", {len(study) - study.computed} of them before"
    lines = [f"{study.about['system']}: {len(study)} runs over {', '.join(study.varied)}{again}"]
    for name in study.results[:_MOST]:
        values = study[name]
        found = values[np.isfinite(values)]
        missing = len(values) - len(found) - len(failures)
        without = f" ({missing} runs have no value)" if missing > 0 else ""
        if len(found):
            lines.append(f"  {name}: {found.min():.6g} to {found.max():.6g}{without}")
        elif missing > 0:
            lines.append(f"  {name}: no value in {missing} runs")
    if len(study.results) > _MOST:
        lines.append(f"  and {len(study.results) - _MOST} columns more")
    if failures:
        lines.append(f"{len(failures)} runs failed:")
        reasons = Counter(failures.values()).most_common()
        lines += [f"  {count} x {reason}" for reason, count in reasons[:_REASONS]]
        if len(reasons) > _REASONS:
            lines.append(f"  and {len(reasons) - _REASONS} reasons more")
    return "\n".join(lines)
