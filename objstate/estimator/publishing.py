"""The published rows of the objects after a scan."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from objstate.estimator.believed import Believed
from objstate.estimator.exposure import Exposure
from objstate.geometry import IntArray
from objstate.objects import ObjectBelief
from objstate.records import Estimate

Fits = dict[str, float | None]
"""By object, the share of the beams reaching it that its most probable state explains."""


def rows(beliefs: Mapping[str, ObjectBelief], fits: Fits) -> list[Estimate]:
    """The estimates of the objects that a scan updated."""
    return [row for name, fit in fits.items() for row in beliefs[name].estimates(fit)]


def lost_rows(believed: Believed, names: Collection[str], stamp_ns: int) -> list[Estimate]:
    """The estimates of the objects near a lost robot's published pose, as of a moment."""
    beliefs = [believed.at(name, stamp_ns) for name in names]
    return [row for belief in beliefs for row in belief.estimates(None, lost=True)]


def share_explained(belief: ObjectBelief, exposure: Exposure, beams: IntArray) -> float:
    """Share of the ``beams`` (k,) reaching an object that its most probable state explains."""
    chosen = np.zeros(len(exposure.scan), dtype=bool)
    chosen[beams] = True
    states = belief.best[None] if belief.presence >= 0.5 else belief.states[:0]
    sight, valid = exposure.sight, exposure.scan.valid
    return sight.whole.share_explained(
        belief.item.name, states, sight.robot.mean, exposure.background[valid], chosen[valid]
    )
