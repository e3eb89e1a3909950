"""Where a round object is, of which only the side towards the sensor is seen."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from objstate.geometry import FloatArray

ROUNDS = 5
SHARED = 0.002  # m, sigma of what all readings of an object have in common
FEW = 3  # readings that a fit needs


@dataclass(frozen=True, eq=False)
class Located:
    """The middle of a round object."""

    position: FloatArray  # (2,) m
    covariance: FloatArray  # (2, 2) m^2
    misfit: float  # m, root mean square distance of the readings from the outline


def located(points: FloatArray, sensor: FloatArray, radius: float, noise: float) -> Located | None:
    """The circle of a known radius that fits readings (n, 2) of its outline from a sensor at (2,).

    Least squares of the distances from the outline, by Gauss and Newton, whatever part of it is seen.
    ``noise`` is m, of a reading. None of fewer than three readings.
    """
    if len(points) < FEW:
        return None
    middle = points.mean(axis=0)
    away = middle - sensor
    away /= np.hypot(*away)
    # readings even over the width of the outline lie pi / 4 of the radius before its middle
    centre = middle + pi / 4.0 * radius * away
    for _ in range(ROUNDS):
        off = points - centre
        distances = np.hypot(off[:, 0], off[:, 1])
        toward = off / np.maximum(distances, 1e-9)[:, None]
        # across what is seen of it little is known; a weak prior keeps it where it began
        normal = toward.T @ toward + (noise / radius) ** 2 * np.eye(2)
        step = np.linalg.solve(normal, toward.T @ (distances - radius))
        centre = centre + step
    misfit = float(np.sqrt(np.mean((distances - radius) ** 2)))
    # neighbouring readings err alike where the shape isn't quite round: they count as their root
    covariance = noise**2 * np.sqrt(len(points)) * np.linalg.inv(normal) + SHARED**2 * np.eye(2)
    return Located(centre, covariance, misfit)
