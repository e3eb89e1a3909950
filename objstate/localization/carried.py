"""How the robot's error at one scan carries over to a later scan.

An object's posterior is conditioned on the error of the pose from which it was observed. Between
two scans of it the pose is corrected by other beams, and moves: the later error is ``transfer``
times the earlier one plus an independent error of covariance ``added``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray

POSE = 3  # numbers of a pose: x, y, yaw
FLOOR = np.diag([1e-3, 1e-3, 1e-3]) ** 2  # m^2, rad^2, beside which a covariance may be nothing
LEAST_KEPT = 1e-3  # share of an error that is kept from one recorded belief to the next


class Carried(NamedTuple):
    """The later error e' of a pose, given the earlier one e: N(transfer e, added)."""

    transfer: FloatArray  # (3, 3)
    added: FloatArray  # (3, 3)


class Decorrelation:
    """Errors of a recorded robot belief, of which only the covariance is known.

    They decorrelate from one belief to the next, which shows in how far a belief is off what
    odometry made of the last one: if a share of the error is kept, the squared distance in units of
    the covariance is 2 (1 - kept) in each direction on average. More than 2 says that the
    covariance is too small. After a single belief, errors decorrelate with the distance driven.
    """

    def __init__(self, length_m: float) -> None:
        self._length_m = length_m
        self._age = 0.0  # over which errors decrease by a factor of e, so far
        self._ages: dict[str, float] = {}  # when an object was last observed
        self._squares, self._directions = 0.0, 0

    def drive(self, way_m: float) -> None:
        """Note a distance driven."""
        if self._directions == 0:
            self._age += way_m / self._length_m

    def renew(self, off: FloatArray, covariance: FloatArray) -> None:
        """Note a belief of a covariance (3, 3) whose mean is ``off`` (3,) the last one's."""
        self._squares += float(off @ np.linalg.solve(covariance + FLOOR, off))
        self._directions += POSE
        self._age -= math.log(max(1.0 - 0.5 * self._strayed, LEAST_KEPT))

    @property
    def _strayed(self) -> float:
        """Mean square of the distance of a belief from the last one, in deviations."""
        return self._squares / max(self._directions, 1)

    def carried(self, name: str, covariance: FloatArray) -> Carried:
        """The error since the object was last observed, for a present covariance (3, 3)."""
        kept = math.exp(self._ages.get(name, -math.inf) - self._age)
        self._ages[name] = self._age
        wider = max(0.5 * self._strayed, 1.0)
        return Carried(kept * np.eye(3), (1.0 - kept**2) * wider * covariance)


class Clones:
    """Errors of poses at which objects were observed, kept beside a filter's state (m,).

    Stochastic cloning (Roumeliotis and Burdick 2002): the cross covariances of earlier errors with
    the present state are updated as the state moves and is corrected.
    """

    def __init__(self) -> None:
        self._first: dict[str, int] = {}  # the first column of each object
        self._covariances: dict[str, FloatArray] = {}  # (3, 3) of the cloned errors
        self.cross = np.empty((0, 0))  # (m, 3 k)

    def select(self, rows: list[int]) -> None:
        """Keep only some rows of the state."""
        self.cross = self.cross[rows]

    def extend(self, count: int) -> None:
        """Append so many rows to the state, independent of all clones."""
        self.cross = np.concatenate([self.cross, np.zeros((count, self.cross.shape[1]))])

    def renew(
        self, name: str, jacobian: FloatArray, present: FloatArray, own: FloatArray
    ) -> Carried:
        """The error since an object was last observed; its clone becomes the present error.

        The error of the pose is the ``jacobian`` (3, m) times the state's. Its covariance with the
        state is ``present`` (m, 3), and its ``own`` is (3, 3).
        """
        if name not in self._first:
            self._first[name] = self.cross.shape[1]
            self.cross = np.concatenate([self.cross, present], axis=1)
            carried = Carried(np.zeros((3, 3)), own)
        else:
            columns = slice(self._first[name], self._first[name] + 3)
            shared = jacobian @ self.cross[:, columns]
            transfer = np.ascontiguousarray(np.linalg.solve(self._covariances[name], shared.T).T)
            carried = Carried(transfer, own - transfer @ shared.T)
            self.cross[:, columns] = present
        self._covariances[name] = own
        return carried
