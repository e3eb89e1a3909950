"""Object beliefs as histograms, for reports."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from objstate.building.model import Kind
from objstate.estimator import Estimator
from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief
from objstate.recording.posteriors import Histogram, PosteriorWriter
from objstate.records import Estimate, Record

STEP_NS = 1_000_000_000  # least time between two histograms of one object
BINS = 64  # 1.5 degrees of a door, 6 of furniture's yaw
NOTHING = np.zeros(1)
EDGES_KEPT = 1024  # number of objects whose bins are cached
PLACE_BIN = 0.025  # m; 64 of them cover the uncertainty of a piece of furniture


class PosteriorRecorder:
    """Writes the beliefs about the objects near the robot, at most once a second each."""

    def __init__(self, writer: PosteriorWriter) -> None:
        self._writer = writer
        self._written_ns: dict[str, int] = {}

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Write the beliefs of estimated objects whose last histogram is old enough."""
        due = {each.object: each.stamp_ns for each in estimates if self._is_due(each)}
        self._written_ns |= due
        for name, stamp in due.items():
            self._writer.write(histograms(estimator.object_at(name, stamp), stamp))

    def _is_due(self, estimate: Estimate) -> bool:
        last = self._written_ns.get(estimate.object)
        return last is None or estimate.stamp_ns - last >= STEP_NS


def histograms(belief: ObjectBelief, stamp_ns: int) -> list[Histogram]:
    """The marginal of each coordinate.

    Bins of doors cover their whole range, those of directions the circle. Bins of places have the
    width ``PLACE_BIN`` and lie around the mean; their edges are multiples of it.
    """
    item = belief.item
    found = []
    for k, coordinate in enumerate(item.coordinates):
        lower, upper = _span(belief, k)
        shares = _shares(belief, k, _edges(lower, upper))
        found.append(Histogram(stamp_ns, item.name, coordinate, lower, upper, shares))
    return found


def _span(belief: ObjectBelief, k: int) -> tuple[float, float]:
    """Where the bins of a coordinate begin and end."""
    if belief.wraps[k]:
        return -np.pi, np.pi
    if belief.item.kind is not Kind.PLANAR:
        return belief.item.lower, belief.item.upper
    first = round(float(belief.mean[k]) / PLACE_BIN) - BINS // 2
    return first * PLACE_BIN, (first + BINS) * PLACE_BIN


@lru_cache(maxsize=EDGES_KEPT)
def _edges(lower: float, upper: float) -> FloatArray:
    """(b + 1,) of even bins."""
    return np.linspace(lower, upper, BINS + 1)


def _shares(belief: ObjectBelief, k: int, edges: FloatArray) -> FloatArray:
    """(b,) of the belief between edges (b + 1,); the outermost bins include what lies outside.

    A sample that represents a cell is spread over its width, so that bins with three cells don't
    alternate with bins with four.
    """
    values, weights, cell = belief.states[:, k], belief.weights.values, float(belief.cell[k])
    if belief.wraps[k]:
        values = wrap(values)
    if cell > 0.0:
        if belief.wraps[k]:
            order = np.argsort(values)
            values, weights = values[order], weights[order]
        ends = values[0] + cell * (np.arange(len(values) + 1) - 0.5)
        filled = np.interp(edges, ends, np.concatenate([NOTHING, np.cumsum(weights)]))
        filled[0], filled[-1] = 0.0, 1.0
        return np.asarray(np.maximum(filled[1:] - filled[:-1], 0.0))
    bins = np.searchsorted(edges, values, side="right") - 1
    shares = np.bincount(bins.clip(0, len(edges) - 2), weights, len(edges) - 1)
    return shares.astype(float)
