"""Whether an object was moved between two beliefs."""

from __future__ import annotations

import numpy as np

from objstate.geometry import wrap
from objstate.objects import ObjectBelief

MOVED_SIGMAS = 4.0  # distance of means, in standard deviations, of beliefs that differ


def contradict(before: ObjectBelief, after: ObjectBelief) -> bool:
    """Whether two beliefs can hardly be of one state, in one of its coordinates at least."""
    off = after.mean - before.mean
    off = np.abs(np.where(after.wraps, wrap(off), off))
    return bool((off > MOVED_SIGMAS * np.hypot(after.std, before.std)).any())
