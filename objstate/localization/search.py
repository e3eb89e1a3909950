"""Where in the building do the last scans fit? From all free places down to a few hypotheses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from objstate.config import Settings
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, between, compose, wrap
from objstate.localization.belief import PoseBelief
from objstate.localization.places import HEADINGS, TURNS, Places
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import Sensing

LogLikelihood = Callable[[FloatArray, float], FloatArray]
"""Tempered log p(o | l) (p,) of poses (p, 3), ranges blurred by so many m."""

APART = np.array([0.75, 0.75, np.radians(20.0)])  # poses that differ by more are other hypotheses
KEPT = 4000  # poses that fit one look all round best, which all other looks then sort out
HYPOTHESES = 12  # of those, that differ, are refined
TRIES = 48  # poses about a hypothesis, in each of the steps below
STEPS = (1.0, 0.35, 0.12)  # of ``SPREAD``
SPREAD = np.array([0.12, 0.12, np.radians(2.5)])  # how far from the truth a looked-up pose may be
HOPELESS = (
    30.0  # by which log-likelihoods are behind the best that further steps don't catch up with it
)
HEIGHT_STEP = 0.1  # m; lasers whose heights differ by less are looked up in one table


@dataclass(frozen=True, eq=False)
class Look:
    """A scan that is remembered, and where the odometry was."""

    scan: Scan
    odometry: FloatArray  # (3,)


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Places that explain the last scans, the best first, and how probable each is."""

    odometry: FloatArray  # (3,) to which they belong
    poses: FloatArray  # (h, 3)
    shares: FloatArray  # (h,) probabilities; they sum to one
    looks: int  # scans from different places that they explain

    def moved(self, odometry: FloatArray) -> FloatArray:
        """The poses (h, 3) driven on to where the odometry is now."""
        return compose(self.poses, between(self.odometry, odometry))

    def belief(self, count: int, rng: np.random.Generator) -> PoseBelief:
        """Samples about every hypothesis, by its share."""
        chosen = np.sort(rng.choice(len(self.poses), count, p=self.shares))
        poses = self.poses[chosen] + rng.standard_normal((count, 3)) * SPREAD * STEPS[1]
        poses[:, 2] = wrap(poses[:, 2])
        return PoseBelief(poses, Weights.uniform(count))


class Search:
    """The search for a robot that may be anywhere in the building."""

    def __init__(self, sensing: Sensing, settings: Settings) -> None:
        self._sensing = sensing
        self._settings = settings
        self._places: dict[int, Places] = {}
        self._looks: dict[str, list[Look]] = {}
        self._last: Hypotheses | None = None

    def forget(self) -> None:
        """What was seen before came from elsewhere."""
        self._looks, self._last = {}, None

    @property
    def looks(self) -> int:
        """Scans of one laser, from different places, that are remembered."""
        return max(map(len, self._looks.values()), default=0)

    def note(self, scan: Scan, odometry: FloatArray) -> bool:
        """Remember a scan if it comes from a new place; whether it was remembered."""
        s, looks = self._settings.search, self._looks.setdefault(scan.laser, [])
        if looks:
            step = between(looks[-1].odometry, odometry)
            driven = float(np.hypot(step[0], step[1]))
            waited = (scan.stamp_ns - looks[-1].scan.stamp_ns) / 1e9
            if driven < s.min_d and abs(step[2]) < s.min_a:
                if waited < s.every_s:
                    return False
                looks.pop()  # from the same place, in which people may have walked on
        looks.append(Look(scan, odometry))
        del looks[: -s.looks]
        return True

    def hypotheses(
        self, explained: Callable[[Scan], LogLikelihood], also: FloatArray, rng: np.random.Generator
    ) -> Hypotheses:
        """The places by which all remembered scans are ``explained`` best; those of ``also`` (k, 3) compete.

        Raises BuildingError where the building has no place to search, and none is given.
        """
        latest = max(
            (looks[-1] for looks in self._looks.values()), key=lambda look: look.scan.stamp_ns
        )
        looks = [look for each in self._looks.values() for look in each]
        steps = [between(latest.odometry, look.odometry) for look in looks]
        found = self._candidates(latest.odometry)
        if self._last is not None:
            also = np.concatenate([also, self._last.moved(latest.odometry)])
        found = np.concatenate([also, found])
        if len(found) == 0:
            raise self._nowhere()
        score = self._looked_up(found, looks, steps)
        score[: len(also)] += score.max() - score.min()  # they aren't sorted out unrefined
        found = _distinct(found, score, HYPOTHESES + len(also))

        log_likelihoods = [explained(look.scan) for look in looks]

        def joint(poses: FloatArray, blur: float) -> FloatArray:
            total = np.zeros(len(poses))
            for log_likelihood, step in zip(log_likelihoods, steps, strict=True):
                total += log_likelihood(compose(poses, step), blur)
            return total

        poses, score = _refined(found, joint, rng)
        order = np.argsort(-score, kind="stable")
        poses, score = poses[order], score[order]
        kept = _distinct_indices(poses, HYPOTHESES)
        shares = np.exp(score[kept] - score.max())
        self._last = Hypotheses(latest.odometry, poses[kept], shares / shares.sum(), self.looks)
        return self._last

    def _candidates(self, odometry: FloatArray) -> FloatArray:
        """Poses that fit the latest scan of each laser best, of all free places and headings."""
        latest, s = [looks[-1] for looks in self._looks.values()], self._settings
        tables = [self._at(look) for look in latest]
        points = next((each for each in tables if len(each.points)), tables[0]).points
        score = np.zeros((len(points), TURNS))
        for look, table in zip(latest, tables, strict=True):
            step = between(odometry, look.odometry)
            score += table.log_likelihoods(
                look.scan, s.beam_model, s.search.max_beams, points, step
            )
        best = np.arange(score.size)
        if len(best) > KEPT:
            best = np.argpartition(-score.ravel(), KEPT)[:KEPT]
        place, turn = np.divmod(best, TURNS)
        return np.column_stack([points[place], HEADINGS[turn]])

    def _nowhere(self) -> BuildingError:
        name, heights = self._sensing.building.name, [k * HEIGHT_STEP for k in self._places]
        return BuildingError(
            f"Building '{name}' has no place to search for the robot: a search needs "
            f"places that walls enclose at the laser's height ({_listed(heights)} m); give the "
            "robot's start instead of --global, or the building its walls."
        )

    def _looked_up(
        self, poses: FloatArray, looks: list[Look], steps: list[FloatArray]
    ) -> FloatArray:
        total = np.zeros(len(poses))
        s = self._settings
        for look, step in zip(looks, steps, strict=True):
            table = self._at(look)
            total += table.log_likelihood(look.scan, s.beam_model, s.search.max_beams, poses, step)
        return total

    def _at(self, look: Look) -> Places:
        """The places as a laser at the look's height sees them."""
        height = float(np.median(look.scan.rays.origins[:, 2]))
        key = round(height / HEIGHT_STEP)
        if key not in self._places:
            walls = self._sensing.walls_at(height)
            self._places[key] = Places.of(walls, self._settings.search)
        return self._places[key]


def _listed(heights: list[float]) -> str:
    return " and ".join(f"{height:.1f}" for height in heights)


def apart(a: FloatArray, b: FloatArray) -> FloatArray:
    """How far poses (..., 3) are from each other, one being where they count as two."""
    off = np.abs(np.stack([*(a - b)[..., :2].T, wrap((a - b)[..., 2]).T], axis=-1))
    return np.asarray((off / APART).max(axis=-1))


def _distinct(poses: FloatArray, score: FloatArray, most: int) -> FloatArray:
    """The best of the poses (p, 3) that lie apart from each other."""
    ordered = poses[np.argsort(-score, kind="stable")]
    return ordered[_distinct_indices(ordered, most)]


def _distinct_indices(poses: FloatArray, most: int) -> list[int]:
    """The first of the poses (p, 3), the first apart from that, and so on."""
    kept: list[int] = []
    free = np.ones(len(poses), dtype=bool)
    while free.any() and len(kept) < most:
        kept.append(int(np.argmax(free)))
        free &= apart(poses, poses[kept[-1]]) > 1.0
    return kept


def _refined(
    poses: FloatArray, joint: LogLikelihood, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """The best poses near poses (h, 3), by closer and closer tries, and their log-likelihoods (h,).

    About each the same is tried, so that none is luckier than others that look alike.
    """
    poses, score = poses.copy(), np.zeros(len(poses))
    for step in STEPS:
        off = rng.standard_normal((TRIES, 3)) * SPREAD * step
        off[0] = 0.0
        for h in np.flatnonzero(score >= score.max() - HOPELESS):
            told = joint(poses[h] + off, step * float(SPREAD[0]) / 2.0)
            best = int(np.argmax(told))
            poses[h], score[h] = poses[h] + off[best], told[best]
    return poses, score
