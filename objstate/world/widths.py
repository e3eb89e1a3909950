"""What a drive tells of leaves' widths: which beams pass the free edge of an open leaf.

A leaf that stands open before a background farther behind is met by the beams that cross it between
its hinge and its free edge, and passed by those beyond. So each beam that crosses the leaf's plane
near its edge tells on which side of that place the edge is, whatever the leaf's angle. The filter
takes a wrong width for noise; so it is told beside it, by some of its scans.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.writing import box_corners
from objstate.config import BeamModelSettings
from objstate.estimator import Estimator
from objstate.geometry import FloatArray, between
from objstate.lazy import Later
from objstate.localization import Vantage
from objstate.records import Estimate, Record, Scan
from objstate.sensing import BeamModel, Sensing

if TYPE_CHECKING:
    from scipy import special
else:
    special = Later("scipy.special")

WIDEST_M, STEP_M = 0.15, 0.003  # by which leaves may be wider or narrower than modelled
WIDTHS = np.arange(-WIDEST_M, WIDEST_M + STEP_M / 2, STEP_M)  # (g,)
OPEN = math.radians(10.0)  # from where it is closed, that a leaf stands clear of its frame
SURE = math.radians(1.0)  # deviation of an angle from which the leaf's place is known
FROM = 0.3  # of a leaf's width, that its edge is beyond
SLANTED = 0.5  # sine of the least angle between beam and leaf: edges are seen half as sharply
MET, PASSED, BEHIND = 0.06, 0.15, 0.3  # m: from the leaf; behind it; least depth of the background
SMEAR_M = 0.012  # deviation of where a beam meets, by its width (2 cm) and the pose (1 cm)
STRAY = 0.02  # share of beams that something else stops, or that pass through
SHARED = 0.3  # information of a scan, as a share of that of independent beams
APART_M, APART = 0.05, math.radians(2.0)  # by which robot or leaf move between scans that are used


@dataclass(frozen=True, eq=False)
class WidthEvidence:
    """What one drive tells of one leaf's free edge, beside any prior.

    The edge's distance from the modelled hinge tells of the width and, along the leaf as it stood,
    of the hinge.
    """

    log: FloatArray = field(default_factory=partial(np.zeros, len(WIDTHS)))  # (g,) of ``WIDTHS``
    aims: FloatArray = field(default_factory=partial(np.zeros, 2))  # (2,) sum of leaves' directions
    count: float = 0.0  # of beams near the edge, over which that sum goes

    def __add__(self, other: WidthEvidence) -> WidthEvidence:
        """What both tell."""
        log = self.log + other.log
        return WidthEvidence(log - log.max(), self.aims + other.aims, self.count + other.count)

    @property
    def aim(self) -> FloatArray:
        """(2,) the mean direction of the leaf."""
        return np.asarray(self.aims / max(self.count, 1.0))

    def beside(self, hinge: FloatArray, width: float) -> WidthEvidence:
        """The same about a model that this one's is off by so much: hinge (2,) and width, m."""
        log = np.interp(WIDTHS - width - float(self.aim @ hinge), WIDTHS, self.log)
        return replace(self, log=log - log.max())

    def blurred(self, deviation: float) -> FloatArray:
        """(g,) log-likelihood with an additional error of a deviation, m."""
        if not self.count:
            return self.log
        kernel = np.exp(-0.5 * (WIDTHS / max(deviation, STEP_M / 4.0)) ** 2)
        padded = np.pad(np.exp(self.log - self.log.max()), len(kernel) // 2, mode="edge")
        return np.asarray(np.log(np.convolve(padded, kernel / kernel.sum(), "valid") + 1e-300))

    def words(self) -> list[float]:
        """As JSON has it."""
        return [*self.aims.round(3).tolist(), self.count, *self.log.round(3).tolist()]

    @staticmethod
    def read(words: Sequence[float] | FloatArray) -> WidthEvidence:
        """Raises ValueError for what isn't such words."""
        values = np.array(words, dtype=float)
        if values.shape != (3 + len(WIDTHS),):
            raise ValueError("the evidence has another form")
        return WidthEvidence(values[3:], values[:2], float(values[2]))


class Edges:
    """Follows an estimator, and notes which beams pass beside leaves."""

    def __init__(self, building: Building, settings: BeamModelSettings) -> None:
        self._boxes = {
            name: corners
            for name, item in building.objects.items()
            if item.kind is Kind.HINGED and (corners := _leaf(item)) is not None
        }
        self._building, self._sensing = building, Sensing(building, BeamModel(settings))
        self._latest: dict[tuple[str, str], tuple[FloatArray, float]] = {}
        self.told: dict[str, WidthEvidence] = {}  # by door

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """A record that the estimator was fed with."""
        robot = estimator.robot
        if not isinstance(record, Scan) or robot is None or not self._sensing.is_level(record):
            return
        seen = [each for each in estimates if self._shows_edge(each)]
        seen = [each for each in seen if self._is_new(record, each.object, robot.mean, each.mean)]
        if not seen:
            return
        vantage = estimator.vantage(record)
        walls = self._sensing.view(record, record.valid).walls(robot.mean[None])[0]
        for each in seen:
            self._see(record, each.object, vantage, walls, each.mean)

    def _shows_edge(self, estimate: Estimate) -> bool:
        """Whether a leaf is a box that surely stands open."""
        name = estimate.object
        if name not in self._boxes or not estimate.observed or estimate.lost:
            return False
        home = float(self._building.objects[name].home[0])
        return estimate.std <= SURE and abs(estimate.mean - home) > OPEN

    def _is_new(self, scan: Scan, name: str, pose: FloatArray, angle: float) -> bool:
        """Whether robot or leaf stood elsewhere in the last scan that was used."""
        before = self._latest.get((name, scan.laser))
        if before is not None and abs(before[1] - angle) < APART:
            x, y, turn = between(before[0], pose)
            if math.hypot(x, y) < APART_M and abs(turn) < APART:
                return False
        self._latest[name, scan.laser] = pose, angle
        return True

    def _see(
        self, scan: Scan, name: str, vantage: Vantage, walls: FloatArray, angle: float
    ) -> None:
        """Take in a scan of a leaf at an angle; ``walls`` (k,) m are those of its valid beams."""
        low, high = self._boxes[name]
        place = self._building.objects[name].transforms(np.array([[angle]]))[0]
        origins = (vantage.origins[scan.valid] - place[:2, 3]) @ place[:2, :2]
        directions = vantage.directions[scan.valid] @ place[:2, :2]
        across = directions[:, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            # (2, n) to both faces
            ways = (np.array([[low[1]], [high[1]]]) - origins[:, 1]) / across
            along = (origins[:, 0] + ways * directions[:, 0]).min(axis=0)
        way = ways.min(axis=0)  # to the face that is met first
        chosen = (way > 0.0) & (np.abs(across) > SLANTED)
        chosen &= (along > FROM * high[0]) & (along < high[0] + WIDEST_M)
        if not chosen.any():
            return
        along, way, walls = along[chosen], way[chosen], walls[chosen]
        ranges = scan.ranges[scan.valid][chosen] - vantage.bias
        met, passed = np.abs(ranges - way) < MET, ranges > way + PASSED
        told = (walls > way + BEHIND) & (met | passed)
        beyond = WIDTHS[:, None] - (along[told] - high[0])  # (g, k) m of the edge
        covers = STRAY + (1.0 - 2.0 * STRAY) * special.ndtr(beyond / SMEAR_M)
        log = np.where(met[told], np.log(covers), np.log1p(-covers)).sum(axis=1)
        near = float(np.count_nonzero(np.abs(along[told] - high[0]) < WIDEST_M))
        seen = WidthEvidence(SHARED * log, near * place[:2, 0], near)
        self.told[name] = self.told.get(name, WidthEvidence()) + seen


def _leaf(item: MovableObject) -> tuple[FloatArray, FloatArray] | None:
    """The corners (3,) of a leaf that is a box along x from its hinge; None for any other."""
    corners = box_corners(item.mesh)
    if corners is None:
        return None
    low, high = corners
    is_thin = high[1] - low[1] < high[0] - low[0]
    return corners if is_thin and abs(low[0]) < FROM * high[0] else None


def wider(leaf: Mesh, by: float) -> Mesh:
    """A leaf, a box along x, that reaches farther from its hinge by so much, m."""
    vertices = leaf.vertices.copy()
    vertices[:, 0] += by * (vertices[:, 0] > vertices[:, 0].mean())
    return Mesh(vertices, leaf.faces)
