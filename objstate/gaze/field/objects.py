"""What looks of a head would tell of objects: eq. (6) of Elfring et al. 2014, with each of its pans."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.gaze.field.head import Head
from objstate.gaze.laser import LaserLooks, LookSettings
from objstate.gaze.prospects import LookLibrary, Prospects
from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief

STEP = math.radians(20.0)  # between the pans from which looks are simulated
HEAD = "head"


class ObjectGains:
    """Simulates looks of one head in one building, and keeps what it has simulated."""

    def __init__(
        self,
        building: Building,
        head: Head,
        settings: Settings | None = None,
        looks: LookSettings | None = None,
    ) -> None:
        s, looks = settings or Settings(), looks or LookSettings()
        count = max(1, math.ceil(2.0 * head.turn / STEP))
        #: (k,) rad from the robot's heading; round a base that turns, the last is next to the first
        self.pans: FloatArray = np.linspace(-head.turn, head.turn, count + 1)
        if head.turns_round:
            self.pans = self.pans[:-1]
        self._head, self._scans = head, looks.scans
        middle = replace(head.sensor, x=0.0, y=0.0, yaw=0.0)  # poses say where it is
        lasers = {HEAD: LaserLooks(building, middle, s, looks)}
        self._library = LookLibrary(building, lasers, s.object_updates.max_distance)

    def bits(self, beliefs: Mapping[str, ObjectBelief], robot: FloatArray) -> dict[str, FloatArray]:
        """(k,) expected of each object that some look shows, with each pan of a robot at (3,)."""
        prospects = Prospects(self._library, beliefs)
        place = self._head.sensor.poses(np.asarray(robot, dtype=float))[:2]
        yaws = wrap(robot[2] + self.pans)
        poses = np.column_stack([np.tile(place, (len(yaws), 1)), yaws])
        near = prospects.near(HEAD, poses)
        found: dict[str, FloatArray] = {}
        for k, pose in enumerate(poses):
            for o in np.flatnonzero(near[k]).tolist():
                name = prospects.names[o]
                told = prospects.evidence(HEAD, name, pose, near[k], self._scans)
                if told is not None:
                    own = found.setdefault(name, np.zeros(len(poses)))
                    own[k] = max(0.0, prospects.gain(name, told)) / math.log(2.0)
        return found
