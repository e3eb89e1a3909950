"""Surveys of several drives, put together: where walls stand and how lasers are mounted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.warping import Columns
from objstate.calibration.calibration import LaserCorrection
from objstate.calibration.surveying import BIAS, MOUNTING, Survey, deviations
from objstate.config import BuildingErrorSettings
from objstate.estimator.doors import Deviation
from objstate.geometry import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csc_array

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
        self._columns, self._error = columns, error
        self._precision = columns.precision(error.wall_length_m)  # (c, c) for a variance of one

    def together(self, surveys: Sequence[Survey]) -> Surveyed:
        """The posterior by all drives. How far walls are off on the whole is learnt."""
        problem = _Problem.of(surveys, self._precision, self._error)
        places, lasers = self._columns.places[problem.seen], problem.lasers
        near = np.hypot(*(places[:, None] - places).T) < self._error.wall_length_m
        variance = problem.variance()
        while True:
            mean, covariance = problem.posterior(variance)
            odds = np.full((len(problem.surveys), len(places)), -np.inf)
            for number, each in enumerate(problem.surveys):
                own = each.placed(lasers)
                odds[number, each.columns] = _hiding(each, mean[own], covariance[np.ix_(own, own)])
            # first those that are likeliest of their column, and of what their drive saw near them
            first = np.array([np.where(near, own, -np.inf).max(axis=1) for own in odds])
            found = (odds > 0.0) & (odds == odds.max(axis=0)) & (odds == first)
            if not found.any():
                break
            problem = problem.without([np.flatnonzero(gone) for gone in found])
        variance = problem.variance()
        mean, covariance = problem.posterior(variance)
        mounted = MOUNTING * len(lasers)
        walls, covariances = problem.all_columns(mean, covariance, variance)
        unmoved = np.append(mean[:mounted], np.zeros(2 * len(places)))
        return Surveyed(
            lasers,
            mean[:mounted].reshape(-1, MOUNTING),
            np.sqrt(np.diag(covariance)[:mounted]).reshape(-1, MOUNTING),
            deviations(self._error),
            walls,
            covariances,
            math.sqrt(variance),
            self._remaining(covariances, variance),
            problem.off(unmoved),
            problem.off(mean),
            sum(len(each.columns) for each in surveys) - problem.count,
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
        if math.exp(-0.5 * medians[worst]) >= CONTRADICTS:
            return None
        usual = float(np.median(self._misfits([*surveys[:worst], *surveys[worst + 1 :]])))
        probability = math.exp(-0.5 * medians[worst] / max(usual / MEDIAN, 1.0))
        return worst if probability < CONTRADICTS else None

    def _misfits(self, surveys: Sequence[Survey]) -> list[float]:
        """Of each drive, chi squared of its median column beside those of the other drives."""
        problem, medians = _Problem.of(surveys, self._precision, self._error), []
        precision, pull = problem.sums(WIDEST_M**2)
        for own in problem.surveys:
            placed = own.placed(problem.lasers)
            others = precision.copy()
            others[np.ix_(placed, placed)] -= own.information
            rest = pull.copy()
            rest[placed] -= own.pull
            covariance = _inverse(others)
            found = (covariance @ rest)[placed]
            known = _blocks_between(own, covariance[np.ix_(placed, placed)])
            off, spread = _apart(own, found, known)
            squares = np.einsum("ci,cij,cj->c", off, np.linalg.inv(spread), off)
            medians.append(float(np.median(squares)) if len(squares) else 0.0)
        return medians

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


@dataclass(frozen=True, eq=False)
class _Problem:
    """Drives and the prior of the columns that they saw; the other columns are integrated out."""

    surveys: tuple[Survey, ...]  # their columns are numbers in ``seen``
    lasers: tuple[str, ...]  # (l,)
    seen: IntArray  # (s,) columns
    walls: FloatArray  # (s, s) prior precision of each coordinate of these, for a variance of one
    unseen: IntArray  # (h,) columns
    following: FloatArray  # (h, s) how these follow those seen
    alone: FloatArray  # (h,) variances of these, given those seen, for a variance of one
    error: BuildingErrorSettings

    @staticmethod
    def of(
        surveys: Sequence[Survey], precision: csc_array, error: BuildingErrorSettings
    ) -> _Problem:
        """With the prior ``precision`` (c, c) of each coordinate of all columns."""
        from scipy.sparse.linalg import splu

        seen = np.unique(np.concatenate([each.columns for each in surveys]))
        unseen = np.setdiff1d(np.arange(precision.shape[0]), seen)
        walls = precision[seen][:, seen].toarray()
        following, alone = np.zeros((0, len(seen))), np.zeros(0)
        if len(unseen):
            own, across = splu(precision[unseen][:, unseen].tocsc()), precision[unseen][:, seen]
            following = -own.solve(across.toarray())
            walls = walls + across.T @ following
            alone = np.diag(own.solve(np.eye(len(unseen))))
        own = tuple(replace(each, columns=np.searchsorted(seen, each.columns)) for each in surveys)
        return _Problem(own, _lasers(surveys), seen, walls, unseen, following, alone, error)

    @property
    def count(self) -> int:
        """How many columns drives saw, all together."""
        return sum(len(each.columns) for each in self.surveys)

    def without(self, columns: Sequence[IntArray]) -> _Problem:
        """The same, where nothing is told of some ``columns`` (h,) by each drive."""
        pairs = zip(self.surveys, columns, strict=True)
        return replace(self, surveys=tuple(each.without(gone) for each, gone in pairs))

    def sums(self, variance: float) -> tuple[FloatArray, FloatArray]:
        """Precision (u, u) and pull (u,) of all drives and the prior, for a variance in m^2."""
        precision, pull = self._prior(variance), np.zeros(self._size)
        for each in self.surveys:
            placed = each.placed(self.lasers)
            precision[np.ix_(placed, placed)] += each.information
            pull[placed] += each.pull
        return precision, pull

    def posterior(self, variance: float) -> tuple[FloatArray, FloatArray]:
        """Mean (u,) and covariance (u, u), for a variance of walls in m^2."""
        precision, pull = self.sums(variance)
        covariance = _inverse(precision)
        return covariance @ pull, covariance

    def variance(self) -> float:
        """m^2, of walls from the model: the square of the posterior mean of their deviation."""
        deviation = Deviation(self.error.wall_std_m, WIDEST_M)
        evidence = self._evidence(deviation.variances)
        deviation.observe("walls", evidence)
        return deviation.variance

    def _evidence(self, variances: FloatArray) -> FloatArray:
        """(k,) log p(z | variance of walls), up to a constant."""
        from scipy.linalg import solve_triangular

        precision, pull = self.sums(math.inf)
        mounted, out = self._mounted, np.empty(len(variances))
        for k, variance in enumerate(variances):
            total = precision.copy()
            total[mounted::2, mounted::2] += self.walls / variance
            total[mounted + 1 :: 2, mounted + 1 :: 2] += self.walls / variance
            factor = np.linalg.cholesky(total)
            half = solve_triangular(factor, pull, lower=True)
            log_det = 2.0 * float(np.log(np.diag(factor)).sum())
            log_prior = (len(total) - mounted) * math.log(variance)
            out[k] = 0.5 * (float(half @ half) - log_det - log_prior)
        return out

    def all_columns(
        self, mean: FloatArray, covariance: FloatArray, variance: float
    ) -> tuple[FloatArray, FloatArray]:
        """Displacements (c, 2) m and covariances (c, 2, 2) of all columns, by a posterior."""
        mounted, count = self._mounted, len(self.seen)
        own = covariance[mounted:, mounted:].reshape(count, 2, count, 2)
        walls = np.empty((count + len(self.unseen), 2))
        covariances = np.empty((len(walls), 2, 2))
        walls[self.seen] = mean[mounted:].reshape(-1, 2)
        walls[self.unseen] = self.following @ walls[self.seen]
        for i, j in np.ndindex(2, 2):
            covariances[self.seen, i, j] = np.diag(own[:, i, :, j])
            followed = (self.following @ own[:, i, :, j]) * self.following
            covariances[self.unseen, i, j] = followed.sum(axis=1) + (i == j) * variance * self.alone
        return walls, covariances

    def off(self, mean: FloatArray) -> FloatArray:
        """(c,) m, how far drives find each column from where a mean (u,) has it, all others held.

        The root of the mean square over the drives that saw it; NaN for columns that none saw.
        """
        squares, seen = np.zeros(len(self.seen)), np.zeros(len(self.seen))
        for each in self.surveys:
            first = MOUNTING * len(each.lasers)
            pull = (each.pull - each.information @ mean[each.placed(self.lasers)])[first:]
            blocks = _own_blocks(each, each.information) + np.eye(2) / WIDEST_M**2
            off = np.linalg.solve(blocks, pull.reshape(-1, 2, 1))[..., 0]
            squares[each.columns] += np.sum(off**2, axis=1)
            seen[each.columns] += 1.0
        out = np.full(len(self.seen) + len(self.unseen), np.nan)
        with np.errstate(invalid="ignore"):
            out[self.seen] = np.sqrt(squares / seen)
        return out

    @property
    def _mounted(self) -> int:
        return MOUNTING * len(self.lasers)

    @property
    def _size(self) -> int:
        return self._mounted + 2 * len(self.seen)

    def _prior(self, variance: float) -> FloatArray:
        """(u, u) precision, for a variance of walls in m^2."""
        mounted, prior = self._mounted, np.zeros((self._size, self._size))
        of_lasers = np.tile(deviations(self.error) ** -2.0, len(self.lasers))
        prior[range(mounted), range(mounted)] = of_lasers
        prior[mounted::2, mounted::2] = prior[mounted + 1 :: 2, mounted + 1 :: 2] = (
            self.walls / variance
        )
        return prior


def _lasers(surveys: Sequence[Survey]) -> tuple[str, ...]:
    return tuple(sorted({laser for each in surveys for laser in each.lasers}))


def _hiding(survey: Survey, mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """(c,) log-odds that something else was seen in place of a column.

    By Bayes' rule on the score test: an additional error of the drive's readings of one column.
    ``mean`` (u,) and ``covariance`` (u, u) are those by all drives, of the drive's unknowns.
    """
    pull, spread = _apart(survey, mean, -_blocks_between(survey, covariance))
    precision = np.eye(2) / HIDING_M**2
    told = 0.5 * np.einsum("ci,cij,cj->c", pull, np.linalg.inv(precision + spread), pull)
    _, log_det = np.linalg.slogdet(np.eye(2) + HIDING_M**2 * spread)
    return np.asarray(told - 0.5 * log_det - math.log((1.0 - HIDDEN) / HIDDEN))


def _apart(survey: Survey, mean: FloatArray, known: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of each column, the drive's pull (c, 2) away from a mean (u,), and its covariance (c, 2, 2).

    ``known`` (c, 2, 2) is what the mean's error adds to that covariance.
    """
    pull = (survey.pull - survey.information @ mean)[MOUNTING * len(survey.lasers) :]
    return pull.reshape(-1, 2), _own_blocks(survey, survey.information) + known + np.eye(2)


def _blocks_between(survey: Survey, covariance: FloatArray) -> FloatArray:
    """(c, 2, 2) of each column, of information times a covariance (u, u) times information."""
    first, information = MOUNTING * len(survey.lasers), survey.information
    half = information[first:] @ covariance
    pairs = half.reshape(-1, 2, half.shape[1]), information[first:].reshape(-1, 2, half.shape[1])
    return np.asarray(np.einsum("ciu,cju->cij", *pairs))


def _own_blocks(survey: Survey, matrix: FloatArray) -> FloatArray:
    """(c, 2, 2) of each column, of a matrix (u, u) of a survey's unknowns."""
    first, count = MOUNTING * len(survey.lasers), len(survey.columns)
    blocks = matrix[first:, first:].reshape(count, 2, count, 2)
    return np.asarray(blocks[range(count), :, range(count)])


def _inverse(precision: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(precision))
