"""Furniture that may be pushed: a second mode of each component, in which it has a velocity.

An interacting multiple model (Blom and Bar-Shalom 1988; ``objstate.association.Motion``) whose
modes are components of the mixture: what stands, and what moves at a nearly constant velocity.
Given its place, a component's velocity doesn't depend on readings. So its Gaussian is carried
beside the errors that a scan corrects, as columns (10,): the velocity's mean (2), its covariance
with the place (2, 2), and its covariance (2, 2). Of what stands, all are zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.association import Motion
from objstate.geometry import BoolArray, FloatArray, IntArray

COLUMNS = 10
MOTION = Motion(walk=0.0, starts=1.0 / 60.0, stops=1.0 / 5.0, speed=0.5, acceleration=0.3)
TURNS = 0.2  # rad; deviation after one second of the heading of what is pushed
LEAST_PUSHED = 1e-4  # weight from which a component changes its mode
TURN_ERROR = 3  # index of the yaw among the errors
PLANAR = np.array([4, 5])  # x, y


class Velocities(NamedTuple):
    """The velocities of components."""

    mean: FloatArray  # (c, 2) m/s
    cross: FloatArray  # (c, 2, 2) m^2/s, covariance with x and y
    covariance: FloatArray  # (c, 2, 2) m^2/s^2

    @staticmethod
    def of(motions: FloatArray) -> Velocities:
        """From columns (c, 10)."""
        squares = motions[:, 2:].reshape(-1, 2, 2, 2)
        return Velocities(motions[:, :2], squares[:, 0], squares[:, 1])

    @property
    def columns(self) -> FloatArray:
        """(c, 10)."""
        squares = self.cross.reshape(-1, 4), self.covariance.reshape(-1, 4)
        return np.concatenate([self.mean, *squares], axis=1)


def moving(motions: FloatArray) -> BoolArray:
    """Which components (c,) move; of furniture that isn't pushed, columns are (c, 0)."""
    if motions.shape[1] == 0:
        return np.zeros(len(motions), dtype=bool)
    return np.asarray(motions[:, -1] > 0.0)


def switched(
    seconds: float, weights: FloatArray, motions: FloatArray, absent: int
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    """The components of which a part begins or ceases to move within some time.

    Returned are the weights (c,) that are left, the numbers (n,) of the components, and the weights
    (n,) and columns (n, 10) of the parts.
    """
    stays, is_moving = MOTION.switches(seconds), moving(motions)
    shares = np.where(is_moving, stays[1, 0], stays[0, 1])
    of = np.flatnonzero((weights > LEAST_PUSHED) & (np.arange(len(weights)) != absent))
    new = np.zeros((len(of), COLUMNS))
    new[~is_moving[of], 6] = new[~is_moving[of], 9] = MOTION.speed**2
    left = weights.copy()
    left[of] *= 1.0 - shares[of]
    return left, of, weights[of] * shares[of], new


def advance(
    seconds: float, places: FloatArray, covariances: FloatArray, motions: FloatArray
) -> None:
    """Move what moves: places (c, 3), covariances (c, 8, 8) and columns (c, 10) change."""
    which = np.flatnonzero(moving(motions))
    if len(which) == 0:
        return
    mean, cross, own = Velocities.of(motions[which])
    driven, eye = MOTION.acceleration, np.eye(2)
    places[which, :2] += seconds * mean
    rows = _planar(which)
    covariances[rows] += (
        seconds * (cross + cross.swapaxes(1, 2))
        + seconds**2 * own
        + driven * seconds**3 / 3.0 * eye
    )
    covariances[which, TURN_ERROR, TURN_ERROR] += TURNS**2 * seconds
    cross = cross + seconds * own + driven * seconds**2 / 2.0 * eye
    motions[which] = Velocities(mean, cross, own + driven * seconds * eye).columns


def corrected(
    motions: FloatArray, before: FloatArray, after: FloatArray, shift: FloatArray
) -> FloatArray:
    """Columns (c, 10) after a scan, whose places it shifted (c, 2).

    Covariances (c, 8, 8) are those before and after it.
    """
    which = np.flatnonzero(moving(motions))
    if len(which) == 0:
        return motions
    out, rows = motions.copy(), _planar(which)
    mean, cross, own = Velocities.of(motions[which])
    gain = cross @ np.linalg.inv(before[rows])
    mean = mean + (gain @ shift[which][:, :, None])[:, :, 0]
    own = own - gain @ (before[rows] - after[rows]) @ gain.swapaxes(1, 2)
    out[which] = Velocities(mean, gain @ after[rows], own).columns
    return out


def shared(
    motions: FloatArray,
    weights: FloatArray,
    places: FloatArray,
    covariances: FloatArray,
    proposed: FloatArray,
    std: FloatArray,
) -> FloatArray:
    """Columns (p, 10) of components proposed at places (p, 3), known to ``std`` (3,).

    Each is of the component that is most probably there.
    """
    out, which = np.zeros((len(proposed), motions.shape[1])), np.flatnonzero(weights > LEAST_PUSHED)
    if len(which) == 0 or not moving(motions).any():
        return out
    rows = _planar(which)
    spread = covariances[rows] + np.diag(std[:2] ** 2)
    inverse = np.linalg.inv(spread)
    off = proposed[:, None, :2] - places[which, :2]
    squared = np.einsum("pci,cij,pcj->pc", off, inverse, off)
    logs = np.log(weights[which] * np.sqrt(np.linalg.det(inverse))) - 0.5 * squared
    best = logs.argmax(axis=1)
    mean, cross, own = (each[best] for each in Velocities.of(motions[which]))
    gain = cross @ inverse[best]
    shift = off[np.arange(len(proposed)), best]
    columns = Velocities(
        mean + (gain @ shift[:, :, None])[:, :, 0],
        gain @ np.diag(std[:2] ** 2),
        own - gain @ cross.swapaxes(1, 2),
    ).columns
    moves = moving(motions[which])[best]
    out[moves] = columns[moves]
    return out


def _planar(which: IntArray) -> tuple[IntArray, ...]:
    """Indices of the blocks (n, 2, 2) of x and y in some covariances (c, 8, 8)."""
    return np.ix_(which, PLANAR, PLANAR)
