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


class Carried(NamedTuple):
    """The later error e' of a pose, given the earlier one e: N(transfer e, added)."""

    transfer: FloatArray  # (3, 3)
    added: FloatArray  # (3, 3)


class Decorrelation:
    """Errors of a recorded robot belief, of which only the covariance is known.

    They decorrelate exponentially with the distance driven.
    """

    def __init__(self, length_m: float) -> None:
        self._length_m = length_m
        self._driven: dict[str, float] = {}  # m, when an object was last observed

    def carried(self, name: str, driven_m: float, covariance: FloatArray) -> Carried:
        """The error since the object was last observed, for a present covariance (3, 3)."""
        way = driven_m - self._driven.get(name, -math.inf)
        self._driven[name] = driven_m
        kept = math.exp(-way / self._length_m)
        return Carried(kept * np.eye(3), (1.0 - kept**2) * covariance)


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
