"""The likelihood of a scan from a place chosen at random, for a robot that may be anywhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.config import Settings
from objstate.geometry import BoolArray, FloatArray
from objstate.localization.places import LEVEL, TURNS, Places
from objstate.records import Scan
from objstate.sensing import BeamModel, Sensing

PLACES = 100  # spread evenly over the building
GOLDEN = 0.6180339887498949  # of a turn, by which headings of consecutive places differ
BLUR = 0.1  # m; smaller offsets of walls don't count
LEAST_CHANCE = 1e-9  # least density of a reading


class Chance(NamedTuple):
    """Tempered log-likelihoods of a scan from places all over the building."""

    mean: float  # log of the mean likelihood
    most: float  # of a scan whose beams all read what is expected
    usual: float  # median, minus ``mean``
    best: float  # largest value, minus ``mean``


class Anywhere:
    """Places all over a building, from each of which a scan is compared with the walls."""

    def __init__(self, sensing: Sensing, settings: Settings) -> None:
        self._sensing = sensing
        self._model = BeamModel(settings.beam_model).blurred(BLUR)
        self._tempering = settings.localization.tempering
        self._ranges: dict[float, FloatArray] = {}

    def usable(self, scan: Scan) -> BoolArray:
        """The beams (n,) of a scan that are valid and level."""
        return np.asarray(scan.valid & (np.abs(scan.rays.directions[:, 2]) <= LEVEL))

    def chance(self, scan: Scan, beams: BoolArray) -> Chance:
        """Tempered log-likelihoods of some beams (n,) of a scan from all places."""
        around = self._around(float(np.median(scan.rays.origins[:, 2])))
        directions, measured = scan.rays.directions[beams], scan.ranges[beams]
        bearings = np.arctan2(directions[:, 1], directions[:, 0]) / (2.0 * np.pi)
        headings = (np.arange(len(around)) * GOLDEN)[:, None]
        turns = np.round((bearings + headings) * TURNS).astype(np.int64) % TURNS
        expected = around[np.arange(len(around))[:, None], turns]
        log = self._tempering * self._model.totals(measured[None], expected, scan.range_max)[0]
        peak, _, _, missing, hit, *_ = self._model.parameters(scan.range_max).tolist()
        should = np.where(np.isinf(measured), missing + hit, peak * np.exp(-0.5))
        most = self._tempering * float(np.log(should.clip(min=LEAST_CHANCE)).sum())
        mean = float(np.logaddexp.reduce(log) - np.log(len(log)))
        log.sort()
        median = 0.5 * float(log[(len(log) - 1) // 2] + log[len(log) // 2])
        return Chance(mean, most, median - mean, float(log[-1]) - mean)

    def _around(self, height: float) -> FloatArray:
        """Ranges (p, TURNS) m in all directions from the places.

        Where walls enclose no place, one place without any range.
        """
        if height not in self._ranges:
            found = Places.some(self._sensing.walls_at(height), PLACES)
            self._ranges[height] = found if len(found) else np.full((1, TURNS), np.inf)
        return self._ranges[height]
