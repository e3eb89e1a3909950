"""What each beam of a scan hit, as far as the believed scene explains it."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.estimator import Estimator
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.records import Scan
from objstate.run.scene.states import shown_state
from objstate.sensing import ExpectedRanges

MARGIN = 0.25  # m


class Hit(IntEnum):
    """What a returning beam hit."""

    WALL = 0
    OBJECT = 1
    UNEXPECTED = 2  # something nearer than all that the building holds
    BEYOND = 3  # it passed through a wall or an object


class HitFinder:
    """Compares scans with what they should read where robot and objects are believed to be."""

    def __init__(self, building: Building) -> None:
        self._expected = ExpectedRanges(building)
        self._reach = {
            name: float(np.linalg.norm(item.mesh.vertices, axis=1).max(initial=0.0))
            for name, item in building.objects.items()
        }

    def hits(self, scan: Scan, robot: PoseBelief, estimator: Estimator) -> np.ndarray:
        """(n,) a ``Hit`` for each beam; what those say that don't return means nothing.

        A reading within ``MARGIN`` of what is expected is explained.
        """
        pose, margin = robot.mean[None], MARGIN
        walls = self._expected.walls(pose, scan.rays)[0]
        objects = np.full(len(scan), np.inf)
        for name, belief in estimator.objects.items():
            state = shown_state(belief)
            if self._is_near(name, belief.item, state, robot.mean, scan.range_max):
                alone = self._expected.object(name, state[None], pose, scan.rays)[0, 0]
                objects = np.minimum(objects, alone)
        nearest = np.minimum(walls, objects)
        explained = np.where(objects < walls, Hit.OBJECT, Hit.WALL)
        found = np.where(scan.ranges < nearest - margin, Hit.UNEXPECTED, explained)
        return np.where(scan.ranges > nearest + margin, Hit.BEYOND, found)

    def _is_near(
        self, name: str, item: MovableObject, state: FloatArray, pose: FloatArray, range_max: float
    ) -> bool:
        place = state[:2] if item.kind is Kind.PLANAR else item.origin[:2, 3]
        slid = abs(float(state[0])) if item.kind is Kind.SLIDING else 0.0
        return float(np.hypot(*(place - pose[:2]))) <= range_max + self._reach[name] + slid
