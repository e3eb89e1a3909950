"""The place of a round object, of which only the side towards the sensor is seen."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from objstate.geometry import FloatArray

ROUNDS = 5
SHARED = 0.002  # m, sigma of what all readings of an object have in common
STRANGE = 3.0  # standard deviations from which a reading has little weight (Geman and McClure)
TINY = 1e-9  # m
SIGMA_OF_MEDIAN = 1.4826  # of a Gaussian
FEW = 3  # readings that a fit needs


@dataclass(frozen=True, eq=False)
class Located:
    """The middle of a round object."""

    position: FloatArray  # (2,) m
    covariance: FloatArray  # (2, 2) m^2
    misfit: float  # m, of the readings from the outline: sigma by their median distance


def located(points: FloatArray, sensor: FloatArray, radius: float, noise: float) -> Located | None:
    """The circle of a known radius that fits readings (n, 2) of its outline from a sensor at (2,).

    Robust least squares of the distances from the outline, by Gauss and Newton, whatever part of it
    is seen. ``noise`` is m, of a reading. None of fewer than three readings.
    """
    if len(points) < FEW:
        return None
    middle = np.median(points, axis=0)
    away = middle - sensor
    away /= np.hypot(*away)
    # readings even over the width of the outline lie pi / 4 of the radius before its middle
    centre = middle + pi / 4.0 * radius * away
    for _ in range(ROUNDS):
        off = points - centre
        distances = np.hypot(off[:, 0], off[:, 1])
        error = distances - radius
        misfit = SIGMA_OF_MEDIAN * float(np.median(np.abs(error)))
        weights = 1.0 / (1.0 + (error / (STRANGE * max(misfit, noise))) ** 2) ** 2
        toward = off / np.maximum(distances, TINY)[:, None]
        # across what is seen of it little is known; a weak prior keeps it where it began
        normal = (weights * toward.T) @ toward + (noise / radius) ** 2 * np.eye(2)
        centre = centre + np.linalg.solve(normal, toward.T @ (weights * error))
    # neighbouring readings err alike where the shape isn't quite round: they count as their root
    covariance = noise**2 * np.sqrt(len(points)) * np.linalg.inv(normal) + SHARED**2 * np.eye(2)
    return Located(centre, covariance, misfit)
