"""How far the odometry is off, as the log itself tells: by how scans correct it.

What scans correct for each metre on average is systematic: wheels smaller than they are taken for, or a laser
that is mounted askew, so that the robot seems to drive aside of where it looks. The rest is random.
The alphas of the motion model are a guess at it, the same for every robot. But what scans correct a belief's mean
by is on average as much, squared, as what they take from its variance, and that is what the way since has
added. Where corrections are smaller, the odometry is better than the alphas say.
"""

from __future__ import annotations

import math

import numpy as np

from objstate.config import OdometryErrorSettings
from objstate.geometry import FloatArray, wrapped
from objstate.localization.belief import PoseBelief
from objstate.localization.motion import Variances

SETTLING = 2.0  # by which a belief's deviation shrinks that hadn't found its place yet


class OdometryError:
    """What the motion model should reckon with, kept up as a robot drives."""

    def __init__(self, settings: OdometryErrorSettings) -> None:
        self._settings = settings
        self._driven_m = settings.weight_m  # that told of what is systematic, the first guess of none included
        self._strayed = np.zeros(3)  # on these, m, m, rad in the robot's frame
        self._corrected = np.full(2, settings.weight)  # squares, along the way and of the heading,
        self._expected = np.full(2, settings.weight)  # by what the alphas say was added
        self.forget()

    @property
    def per_metre(self) -> FloatArray:
        """(3,) ahead, to the left, and rad to the left, for each metre that the odometry tells."""
        return self._strayed / self._driven_m

    @property
    def factors(self) -> Variances:
        """By how much the variances of lengths and of turns should be larger than the alphas say."""
        s = self._settings
        length, turn = (self._corrected / self._expected).tolist()
        return Variances(min(max(length, s.least), s.most), min(max(turn, s.least), s.most))

    def drive(self, step: FloatArray, variances: Variances) -> tuple[FloatArray, Variances]:
        """Take in a step (3,) of the odometry, to which the alphas give variances; what both are by now."""
        length, turn = self.factors
        self._is_standing = False
        self._ahead_m += float(step[0])
        self._way_m += math.hypot(step[0], step[1])
        self._turned += abs(float(step[2]))
        self._added += variances
        strayed = self.per_metre * step[0]
        self._reckoned += strayed
        return step + strayed, Variances(length * variances.length, turn * variances.turn)

    def note(self, before: PoseBelief, after: PoseBelief) -> None:
        """Take in how a scan corrected the belief.

        Scans from one place repeat each other's errors: of those from where the robot stands, the first counts.
        """
        if self._is_standing:
            return
        self._is_standing = True
        if self._std is None:
            self._std = before.position_std
        yaw = float(before.mean[2])
        cos, sin = math.cos(yaw), math.sin(yaw)
        dx, dy, turned = (after.mean - before.mean).tolist()
        self._moved += (cos * dx + sin * dy, cos * dy - sin * dx, wrapped(turned))
        (xx, xy, _), (_, yy, _), (_, _, turns) = (before.covariance - after.covariance).tolist()
        self._taken += (cos * cos * xx + 2.0 * cos * sin * xy + sin * sin * yy, turns)
        s = self._settings
        if self._way_m >= s.stretch_m or self._turned >= math.radians(s.stretch_deg):
            if self._std <= SETTLING * after.position_std:
                self._learn()
            self.forget()

    def forget(self) -> None:
        """Leave the stretch aside that the robot is on: it wasn't followed."""
        self._is_standing = True
        self._std: float | None = None  # of the position, at its first scan
        self._ahead_m, self._way_m, self._turned = 0.0, 0.0, 0.0
        self._added, self._taken = np.zeros(2), np.zeros(2)  # of the variances; by the alphas
        self._reckoned, self._moved = np.zeros(3), np.zeros(3)  # as systematic; by scans

    def _learn(self) -> None:
        """What scans took of what was added says how much of it they see."""
        seen = np.minimum(self._taken / (np.array(self.factors) * self._added), 1.0)
        told = (self._added > 0.0) & (seen > 0.0)
        random = self._moved[[0, 2]][told]
        self._corrected[told] += random**2 / self._added[told]
        self._expected[told] += seen[told]
        self._driven_m += abs(self._ahead_m)
        self._strayed += math.copysign(1.0, self._ahead_m) * (self._moved + self._reckoned)
