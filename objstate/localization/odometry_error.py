"""Errors of the odometry, learnt from how scans correct it.

Corrections in proportion to the distance and to turns are systematic: wheels smaller than assumed,
a gyro that underestimates turns, or a laser that is mounted askew, so that the robot seems to drive
sideways. The remaining errors are random. The alphas of the motion model are a first guess of them.
On average, the squared correction of a belief's mean equals what scans remove from its variance,
and in the long run that is what the odometry has added. Where corrections are smaller, the odometry
is better than the alphas say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from objstate.config import OdometryErrorSettings
from objstate.geometry import FloatArray, wrapped
from objstate.localization.belief import PoseBelief
from objstate.localization.motion import Variances

NONE = Variances(0.0, 0.0)
SETTLING = 2.0  # ratio of a belief's deviations from which on it was still converging


@dataclass(eq=False)
class _Stretch:
    """Some distance by the odometry, and how scans corrected it; in the robot's frame."""

    std: float  # m, of the position, at its beginning
    driven: FloatArray = field(  # (3,) m ahead, m and rad to the left, by the odometry
        default_factory=partial(np.zeros, 3)
    )
    way_m: float = 0.0
    turned: float = 0.0  # rad, sum of absolute turns
    added: Variances = NONE  # to lengths and turns, by the alphas
    taken: Variances = NONE  # removed from them by scans
    corrected: FloatArray = field(  # (3,) m, m, rad: correction of the mean by scans
        default_factory=partial(np.zeros, 3)
    )


class OdometryError:
    """The corrections of the motion model, updated while a robot drives."""

    def __init__(self, settings: OdometryErrorSettings) -> None:
        self._settings = settings
        # sums over stretches: products of the measured motions, and of the deviations with them
        self._driven = settings.none_systematic * np.eye(3)
        self._strayed = np.zeros((3, 3))
        self._systematic: FloatArray = np.zeros((3, 3))
        # likewise: squared corrections over the variances of the alphas, of lengths and of turns
        self._corrected = np.full(2, settings.weight)
        self._expected = np.full(2, settings.weight)
        self._factors = self._found_factors()
        self._open: _Stretch | None = None
        self._is_standing = True

    @property
    def systematic(self) -> FloatArray:
        """(3, 3) m ahead, m and rad to the left to be added for each of these that are measured.

        Least squares over all stretches, with a prior of no systematic error.
        """
        return self._systematic

    @property
    def factors(self) -> Variances:
        """Factors on the variances of lengths and of turns that the alphas give."""
        return self._factors

    def to_dict(self) -> dict[str, Any]:
        """What was learnt, for ``run.json``."""
        length, turn = self.factors
        return {
            "systematic": self.systematic.tolist(),
            "length_factor": length,
            "turn_factor": turn,
        }

    def drive(self, step: FloatArray, variances: Variances) -> tuple[FloatArray, Variances]:
        """A step (3,) of the odometry, corrected, and its variances, given those of the alphas."""
        self._is_standing = False
        stretch, (length, turn) = self._open, self._factors
        if stretch is not None:
            ahead, left, turned = step.tolist()
            stretch.driven += step
            stretch.way_m += math.hypot(ahead, left)
            stretch.turned += abs(turned)
            stretch.added = stretch.added.plus(variances)
        return step + self._systematic @ step, Variances(
            length * variances.length, turn * variances.turn
        )

    def note(self, before: PoseBelief, after: PoseBelief) -> None:
        """Record how a scan corrected the belief.

        Scans from one place repeat each other's errors, so that only the first counts while the
        robot stands.
        """
        if self._is_standing:
            return
        self._is_standing, s, stretch = True, self._settings, self._open
        if stretch is None:
            self._open = _Stretch(after.position_std)
            return
        yaw = float(before.mean[2])
        cos, sin = math.cos(yaw), math.sin(yaw)
        dx, dy, turned = (after.mean - before.mean).tolist()
        stretch.corrected += (cos * dx + sin * dy, cos * dy - sin * dx, wrapped(turned))
        (xx, xy, _), (_, yy, _), (_, _, turns) = (before.covariance - after.covariance).tolist()
        lengths = cos * cos * xx + 2.0 * cos * sin * xy + sin * sin * yy
        stretch.taken = stretch.taken.plus(Variances(lengths, turns))
        if stretch.way_m >= s.stretch_m or stretch.turned >= math.radians(s.stretch_deg):
            if stretch.std <= SETTLING * after.position_std:
                self._learn(stretch)
            self._open = _Stretch(after.position_std)

    def forget(self) -> None:
        """Discard the present stretch: the robot wasn't followed."""
        self._open = None

    def _learn(self, stretch: _Stretch) -> None:
        """Learn from a stretch, as far as scans observed what was added on it."""
        factors, corrected = np.array(self.factors), stretch.corrected[[0, 2]]
        added, taken = np.array(stretch.added), np.array(stretch.taken)
        informative = (added > 0.0) & (taken > 0.0)
        added, taken = added[informative], taken[informative]
        self._corrected[informative] += corrected[informative] ** 2 / added
        self._expected[informative] += np.minimum(taken / (factors[informative] * added), 1.0)
        strayed = stretch.corrected + self._systematic @ stretch.driven
        self._driven += np.outer(stretch.driven, stretch.driven)
        self._strayed += np.outer(strayed, stretch.driven)
        self._systematic = np.asarray(np.linalg.solve(self._driven, self._strayed.T).T)
        self._factors = self._found_factors()

    def _found_factors(self) -> Variances:
        s, (length, turn) = self._settings, (self._corrected / self._expected).tolist()
        return Variances(min(max(length, s.least), s.most), min(max(turn, s.least), s.most))
