"""The options of a calibration: priors, and which readings count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CalibrationOptions:
    """Assumptions of the adjustment; the defaults serve."""

    # deviations of what is sought, before any reading
    prior_xy: float = 0.05  # m, of each laser's place
    prior_yaw: float = float(np.radians(3.0))  # rad, of its direction
    prior_clock: float = 0.05  # s, of its clock
    # and of the odometry's systematic errors
    prior_scale: float = 0.03  # share by which ways are counted too long
    prior_drift: float = 0.02  # rad/m
    # of the prior's deviation: wider corrections count as not determined
    told_below: float = 1.0 / 3.0

    # odometry's random errors after 1 m (or 1 rad); they grow with the root of the way
    way_noise: float = 0.02  # m, along
    aside_noise: float = 0.005  # m, to the side
    drift_noise: float = 0.015  # rad after 1 m
    turn_noise: float = 0.03  # rad after 1 rad
    slip_noise: float = 0.005  # m, along and to the side, after 1 rad

    spacing: float = 0.1  # m between scans of a laser that are used
    spacing_yaw: float = 0.05  # rad of turning that also makes a scan worth using
    most_scans: int = 2000  # evenly chosen where there are more
    beams: int = 90  # of a scan, evenly spread
    spread: float = 0.2  # m from a wall within which readings initially count as of the wall
    shared: float = 0.3  # information of a scan, as a share of that of independent beams
    wall_spread: float = 0.02  # m; initial deviation of walls from the model
    place: float = 2.0  # m; in squares of this size, what faces one way is one piece of wall
    parts: int = 4  # of a drive, that are compared with each other
    rounds: int = 8  # of linearization
