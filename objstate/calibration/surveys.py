"""Surveys of several drives, put together: where walls stand and how lasers are mounted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.warping import Columns
from objstate.calibration.calibration import LaserCorrection
from objstate.calibration.surveying import BIAS, MOUNTING, Survey, deviations
from objstate.config import BuildingErrorSettings
from objstate.estimator.doors import Deviation
from objstate.geometry import FloatArray

WIDEST_M = 0.05  # deviation of walls; maps that are farther off are of no use
CONTRADICTS = 1e-6  # probability of a drive that differs so much more from the others than they do
LEAST_DRIVES = 3  # of which one can contradict the others
MEDIAN = 1.386  # of chi squared of two degrees of freedom
HIDDEN, HIDING_M = 0.01, 0.1  # share of columns that things hide; m, deviation of these from walls


@dataclass(frozen=True, eq=False)
class Surveyed:
    """The posterior of what drives share."""

    lasers: tuple[str, ...]  # (l,)
    mountings: FloatArray  # (l, 4) x m, y m, yaw rad, bias of ranges m
    mounting_stds: FloatArray  # (l, 4)
    mounting_priors: FloatArray  # (4,) deviations before any drive
    walls: FloatArray  # (c, 2) m, displacements of columns
    covariances: FloatArray  # (c, 2, 2) m^2
    wall_std: float  # m, learnt deviation of walls from the model
    remaining_std: float  # m, of walls that were seen, after they were learnt
    before: FloatArray  # (c,) m, how far drives find a column off the model; NaN if none saw it
    after: FloatArray  # (c,) m, the same of where it is now
    hidden: int  # number of columns that a drive saw something else in place of, all drives

    def correction(self, frame: str, mount: FloatArray, told_below: float) -> LaserCorrection:
        """Of a laser's mounting (4, 4), as far as its deviations are ``told_below`` the prior's."""
        number = self.lasers.index(frame)
        std, clock = self.mounting_stds[number], np.zeros(1)
        told = np.append(std[:BIAS] < told_below * self.mounting_priors[:BIAS], False)
        moved = np.append(self.mountings[number, :BIAS], clock)
        return LaserCorrection(frame, mount, 0.0, moved, np.append(std[:BIAS], clock), told)


class Surveys:
    """What is known of walls and lasers before any drive, and by some."""

    def __init__(self, columns: Columns, error: BuildingErrorSettings) -> None:
        from scipy.sparse import eye_array, kron

        self._columns, self._error = columns, error
        own = kron(columns.precision(error.wall_length_m), eye_array(2)).toarray()
        self._walls = np.asarray(own)  # (2c, 2c) prior precision for a variance of one

    def together(self, surveys: Sequence[Survey]) -> Surveyed:
        """The posterior by all drives. How far walls are off on the whole is learnt."""
        lasers, hidden = _lasers(surveys), [np.zeros(0, dtype=np.int64)] * len(surveys)
        variance = self._variance(*self._sums(surveys, lasers), lasers)
        while True:
            kept = [each.without(gone) for each, gone in zip(surveys, hidden, strict=True)]
            information, pull = self._sums(kept, lasers)
            covariance = _inverse(information + self._prior(lasers, variance))
            mean = covariance @ pull
            odds = np.full((len(kept), len(self._columns.places)), -np.inf)
            for number, each in enumerate(kept):
                own = each.placed(lasers)
                odds[number, each.columns] = _hiding(each, mean[own], covariance[np.ix_(own, own)])
            # first those that are likeliest of their column, and of their drive
            found = (odds > 0.0) & (odds == odds.max(axis=0)) & (odds == odds.max(axis=1)[:, None])
            if not found.any():
                break
            hidden = [
                np.union1d(gone, np.flatnonzero(more))
                for gone, more in zip(hidden, found, strict=True)
            ]
        variance = self._variance(information, pull, lasers)
        covariance = _inverse(information + self._prior(lasers, variance))
        mean = covariance @ pull
        mounted, count = MOUNTING * len(lasers), len(self._columns.places)
        blocks = covariance[mounted:, mounted:].reshape(count, 2, count, 2)
        covariances = blocks[np.arange(count), :, np.arange(count)]
        return Surveyed(
            lasers,
            mean[:mounted].reshape(-1, MOUNTING),
            np.sqrt(np.diag(covariance)[:mounted]).reshape(-1, MOUNTING),
            deviations(self._error),
            mean[mounted:].reshape(-1, 2),
            covariances,
            math.sqrt(variance),
            self._remaining(covariances, variance),
            self._off(kept, np.append(mean[:mounted], np.zeros(2 * count)), lasers),
            self._off(kept, mean, lasers),
            sum(map(len, hidden)),
        )

    def contradicting(self, surveys: Sequence[Survey]) -> int | None:
        """The drive whose walls contradict those of all others most, if one does.

        Things that stand before walls hide few of them. In a drive that contradicts, most columns
        are elsewhere, by far more than in the others.
        """
        if len(surveys) < LEAST_DRIVES:
            return None
        medians = self._misfits(surveys)
        worst = int(np.argmax(medians))
        usual = float(np.median(self._misfits([*surveys[:worst], *surveys[worst + 1 :]])))
        probability = math.exp(-0.5 * medians[worst] / max(usual / MEDIAN, 1.0))
        return worst if probability < CONTRADICTS else None

    def _misfits(self, surveys: Sequence[Survey]) -> list[float]:
        """Of each drive, chi squared of its median column beside those of the other drives."""
        lasers, medians = _lasers(surveys), []
        information, pull = self._sums(surveys, lasers)
        covariance = _inverse(information + self._prior(lasers, WIDEST_M**2))
        mean = covariance @ pull
        for own in surveys:
            placed = own.placed(lasers)
            together = _inverse(covariance[np.ix_(placed, placed)])
            alone = _inverse(together - own.information + np.eye(len(placed)))  # without this one
            found = alone @ (together @ mean[placed] - own.pull)
            off, spread = _apart(own, found, own.information @ alone @ own.information)
            squares = np.einsum("ci,cij,cj->c", off, np.linalg.inv(spread), off)
            medians.append(float(np.median(squares)) if len(squares) else 0.0)
        return medians

    def _variance(self, information: FloatArray, pull: FloatArray, lasers: Sequence[str]) -> float:
        """m^2, of walls from the model: the square of the posterior mean of their deviation."""
        deviation = Deviation(self._error.wall_std_m, WIDEST_M)
        evidence = [self._evidence(information, pull, lasers, v) for v in deviation.variances]
        deviation.observe("walls", np.array(evidence))
        return deviation.variance

    def _off(
        self, surveys: Sequence[Survey], mean: FloatArray, lasers: Sequence[str]
    ) -> FloatArray:
        """(c,) m, how far drives find each column from where a mean has it, all others held.

        The root of the mean square over the drives that saw it; NaN for columns that none saw.
        """
        squares, seen = np.zeros(len(self._columns.places)), np.zeros(len(self._columns.places))
        for each in surveys:
            first = MOUNTING * len(each.lasers)
            pull = (each.pull - each.information @ mean[each.placed(lasers)])[first:].reshape(-1, 2)
            blocks = each.information[first:, first:].reshape(len(pull), 2, len(pull), 2)
            own = blocks[range(len(pull)), :, range(len(pull))] + np.eye(2) / WIDEST_M**2
            off = np.linalg.solve(own, pull[..., None])[..., 0]
            squares[each.columns] += np.sum(off**2, axis=1)
            seen[each.columns] += 1.0
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(squares / seen))

    def _sums(
        self, surveys: Sequence[Survey], lasers: Sequence[str]
    ) -> tuple[FloatArray, FloatArray]:
        """Information (u, u) and pull (u,) of all drives."""
        size = MOUNTING * len(lasers) + len(self._walls)
        information, pull = np.zeros((size, size)), np.zeros(size)
        for each in surveys:
            placed = each.placed(lasers)
            information[np.ix_(placed, placed)] += each.information
            pull[placed] += each.pull
        return information, pull

    def _prior(self, lasers: Sequence[str], variance: float) -> FloatArray:
        """(u, u) precision, for a variance of walls in m^2."""
        of_lasers = np.tile(deviations(self._error) ** -2.0, len(lasers))
        mounted = len(of_lasers)
        prior = np.zeros((mounted + len(self._walls),) * 2)
        prior[range(mounted), range(mounted)] = of_lasers
        prior[mounted:, mounted:] = self._walls / variance
        return prior

    def _evidence(
        self, information: FloatArray, pull: FloatArray, lasers: Sequence[str], variance: float
    ) -> float:
        """log p(z | variance of walls), up to a constant."""
        factor = np.linalg.cholesky(information + self._prior(lasers, variance))
        half = np.linalg.solve(factor, pull)
        log_det = 2.0 * float(np.log(np.diag(factor)).sum())
        return 0.5 * (float(half @ half) - log_det - len(self._walls) * math.log(variance))

    def _remaining(self, covariances: FloatArray, variance: float) -> float:
        """m, deviation along the normals of walls, weighted by the share that is learnt of each."""
        pairs, distances = self._columns.edges
        along = self._columns.places[pairs[:, 1]] - self._columns.places[pairs[:, 0]]
        normals = np.column_stack([-along[:, 1], along[:, 0]]) / distances[:, None]
        of_ends = np.einsum("ei,ekij,ej->ek", normals, covariances[pairs], normals)
        weights = distances[:, None] * (1.0 - of_ends / variance).clip(min=0.0)
        if not weights.any():
            return math.sqrt(variance)
        return math.sqrt(float((weights * of_ends).sum() / weights.sum()))


def _lasers(surveys: Sequence[Survey]) -> tuple[str, ...]:
    return tuple(sorted({laser for each in surveys for laser in each.lasers}))


def _hiding(survey: Survey, mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """(c,) log-odds that something else was seen in place of a column.

    By Bayes' rule on the score test: an additional error of the drive's readings of one column.
    ``mean`` (u,) and ``covariance`` (u, u) are those by all drives, of the drive's unknowns.
    """
    known = -(survey.information @ covariance @ survey.information)
    pull, spread = _apart(survey, mean, known)
    precision = np.eye(2) / HIDING_M**2
    told = 0.5 * np.einsum("ci,cij,cj->c", pull, np.linalg.inv(precision + spread), pull)
    _, log_det = np.linalg.slogdet(np.eye(2) + HIDING_M**2 * spread)
    return np.asarray(told - 0.5 * log_det - math.log((1.0 - HIDDEN) / HIDDEN))


def _apart(survey: Survey, mean: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of each column, the drive's pull (c, 2) away from a mean (u,), and its covariance (c, 2, 2).

    ``known`` (u, u) is what the mean's error adds to the covariance of the pull.
    """
    pull = survey.pull - survey.information @ mean
    spread = survey.information + known
    first, count = MOUNTING * len(survey.lasers), len(survey.columns)
    blocks = spread[first:, first:].reshape(count, 2, count, 2)[range(count), :, range(count)]
    return pull[first:].reshape(-1, 2), blocks + np.eye(2)


def _inverse(precision: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(precision))
