"""Means over seeds with their intervals, as text."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

LEVEL = 0.95


def spread(values: Iterable[float], decimals: int = 1, scale: float = 1.0) -> str:
    """The mean of what is a number, with Student's interval of 95 %: ``75.0 ± 1.2``; a dash of nothing."""
    from scipy.stats import t

    listed = scale * np.array(list(values))
    listed = listed[np.isfinite(listed)]
    if not len(listed):
        return "-"
    mean = f"{listed.mean():.{decimals}f}"
    if len(listed) == 1:
        return mean
    half = t.ppf((1 + LEVEL) / 2, len(listed) - 1) * listed.std(ddof=1) / np.sqrt(len(listed))
    return f"{mean} ± {half:.{decimals}f}"
