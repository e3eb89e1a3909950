"""Surveys of several drives, put together: where walls stand and how lasers are mounted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.warping import Columns
from objstate.calibration.surveying import MOUNTING, Survey, deviations
from objstate.config import BuildingErrorSettings
from objstate.estimator.doors import Deviation
from objstate.geometry import FloatArray

WIDEST_M = 0.05  # deviation of walls; maps farther off are no maps


@dataclass(frozen=True, eq=False)
class Surveyed:
    """The posterior of what drives share."""

    lasers: tuple[str, ...]  # (l,)
    mountings: FloatArray  # (l, 4) x m, y m, yaw rad, bias of ranges m
    mounting_stds: FloatArray  # (l, 4)
    walls: FloatArray  # (c, 2) m, displacements of columns
    covariances: FloatArray  # (c, 2, 2) m^2
    wall_std: float  # m, learnt deviation of walls from the model


def put_together(
    surveys: Sequence[Survey], columns: Columns, error: BuildingErrorSettings
) -> Surveyed:
    """The posterior by all drives. How far walls are off on the whole is learnt."""
    from scipy.sparse import kron, eye_array

    lasers = tuple(sorted({laser for each in surveys for laser in each.lasers}))
    mounted, count = MOUNTING * len(lasers), len(columns.places)
    information = np.zeros((mounted + 2 * count, mounted + 2 * count))
    pull = np.zeros(len(information))
    for each in surveys:
        placed = each.placed(lasers, count)
        information[np.ix_(placed, placed)] += each.information
        pull[placed] += each.pull
    of_lasers = np.tile(deviations(error) ** -2.0, len(lasers))
    of_walls = kron(columns.precision(error.wall_length_m), eye_array(2)).toarray()
    deviation = Deviation(error.wall_std_m, WIDEST_M)
    log, solved = [], []
    for variance in deviation.variances:
        prior = np.zeros_like(information)
        prior[range(mounted), range(mounted)] = of_lasers
        prior[mounted:, mounted:] = of_walls / variance
        covariance = np.linalg.inv(information + prior)
        mean = covariance @ pull
        _, log_det = np.linalg.slogdet(covariance)
        log.append(0.5 * (pull @ mean + log_det - 2 * count * np.log(variance)))
        solved.append((mean, covariance))
    deviation.observe("walls", np.array(log))
    best = int(np.argmin(np.abs(deviation.variances - deviation.variance)))
    mean, covariance = solved[best]
    stds = np.sqrt(np.diag(covariance)[:mounted])
    blocks = covariance[mounted:, mounted:].reshape(count, 2, count, 2)
    return Surveyed(
        lasers,
        mean[:mounted].reshape(-1, MOUNTING),
        stds.reshape(-1, MOUNTING),
        mean[mounted:].reshape(-1, 2),
        blocks[np.arange(count), :, np.arange(count)],
        float(np.sqrt(deviation.variances[best])),
    )
