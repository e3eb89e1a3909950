"""The search for a robot that may be anywhere: from all free places to a few hypotheses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from objstate.config import Settings
from objstate.errors import BuildingError
from objstate.geometry import BoolArray, FloatArray, between, compose, wrap
from objstate.lazy import lazy
from objstate.localization.belief import PoseBelief
from objstate.localization.places import HEADINGS, TURNS, Places
from objstate.particles import Weights
from objstate.particles.weights import NEVER
from objstate.records import Scan
from objstate.sensing import Sensing

LogLikelihood = Callable[[FloatArray, float], FloatArray]
"""Tempered log p(o | l) (h, p) of poses (h, p, 3), each row close together; ranges blurred by m."""

# poses that differ by more are different hypotheses
APART = np.array([0.75, 0.75, np.radians(20.0)])
KEPT = 4000  # poses that fit one keyframe best, of which the other keyframes choose
HYPOTHESES = 12  # number of distinct ones that are refined
TRIES = 24  # poses around a hypothesis, in each of the following steps
STEPS = (2.5, 1.0, 0.35, 0.12, 0.05)  # in units of ``SPREAD``
# standard deviation of a looked-up pose about the true one
SPREAD = np.array([0.12, 0.12, np.radians(2.5)])
HOPELESS = 15.0  # log odds behind the best place from which further steps are useless
FINEST = STEPS[-1] * float(SPREAD[0]) / 2.0  # m by which ranges are blurred in the last step
SLIP_M, SLIP_RAD = 0.5, 0.35  # median distance and turn of a slip
INDEPENDENCE = (
    0.6  # exponent on the likelihoods of keyframes, since those from near places share evidence
)
OUTSIDE = 0.1  # share of kidnaps that lead to places that the map doesn't show
HEIGHT_STEP = 0.1  # m; lasers whose heights differ by less share one table


class Odds(NamedTuple):
    """Odds that the robot is elsewhere, relative to its being at the followed place."""

    kidnapped: float = 0.0  # to anywhere in the building
    slipped: float = 0.0  # to a place near by
    width: float = (
        0.0  # m, width of the followed belief where it was wide: the robot may be anywhere within
    )

    def plus(self, other: Odds) -> Odds:
        """The odds of either."""
        return Odds(
            self.kidnapped + other.kidnapped,
            self.slipped + other.slipped,
            max(self.width, other.width),
        )

    def times(self, factor: float) -> Odds:
        """The odds multiplied by a factor, of a belief that isn't wide any more."""
        return Odds(self.kidnapped * factor, self.slipped * factor)


SAME = np.array([0.3, 0.3, np.radians(8.0)])  # places that differ by less are the same
NO_ODDS = Odds()


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A scan that is kept, the odometry, and the belief at that time."""

    scan: Scan
    odometry: FloatArray  # (3,)
    followed: FloatArray | None = None  # (3,) the pose at which the robot was followed
    before: Odds = NO_ODDS  # of being elsewhere at the previous keyframe already
    since: Odds = NO_ODDS  # of having come elsewhere since then
    chance: float = 0.0  # tempered log p(o) of the scan, averaged over places all over the building
    since_searched: bool = True  # whether no search had one from the same place
    reached: FloatArray | None = None  # (3,) odometry at the first one from there, if another was

    @property
    def place(self) -> FloatArray:
        """(3,) odometry at the first keyframe from its place."""
        return self.odometry if self.reached is None else self.reached


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Places that explain the keyframes, the best first, with their probabilities."""

    odometry: FloatArray  # (3,) at which they hold
    poses: FloatArray  # (h, 3)
    log_odds: FloatArray  # (h,) relative to the followed place, or to chance where none is followed
    is_followed: BoolArray  # (h,) whether it is the followed place
    stamp_ns: int  # of the last keyframe
    outside: float = 0.0  # log odds of places that the map doesn't show
    # (h,) probability that the robot was carried there instead of slipping, if it is there
    carried: FloatArray = field(default_factory=lambda: np.ones(1))
    keyframes: int = 1  # number of those that were searched by

    @property
    def shares(self) -> FloatArray:
        """(h,) probabilities, given that the robot is at one of them."""
        shares = np.exp(self.log_odds - self.log_odds.max())
        return np.asarray(shares / shares.sum())

    def moved(self, odometry: FloatArray) -> FloatArray:
        """The poses (h, 3) moved on to the present odometry."""
        return compose(self.poses, between(self.odometry, odometry))

    def belief(self, count: int, rng: np.random.Generator) -> PoseBelief:
        """Samples around every hypothesis, by its probability."""
        chosen = np.sort(rng.choice(len(self.poses), count, p=self.shares))
        poses = self.poses[chosen] + rng.standard_normal((count, 3)) * SPREAD * STEPS[2]
        poses[:, 2] = wrap(poses[:, 2])
        return PoseBelief(poses, Weights.uniform(count))


class Search:
    """The search for a robot that may be anywhere in the building."""

    def __init__(self, sensing: Sensing, settings: Settings) -> None:
        self._sensing = sensing
        self._settings = settings
        self._places: dict[int, Places] = {}
        self._keyframes: dict[str, list[Keyframe]] = {}
        self._last: Hypotheses | None = None

    def forget(self) -> None:
        """Discard all keyframes: the robot came elsewhere."""
        self._keyframes, self._last = {}, None

    @property
    def keyframes(self) -> list[Keyframe]:
        """The keyframes in time order."""
        keyframes = [keyframe for each in self._keyframes.values() for keyframe in each]
        return sorted(keyframes, key=lambda keyframe: keyframe.scan.stamp_ns)

    def note(self, keyframe: Keyframe) -> bool:
        """Keep a scan as a keyframe if it comes from a new place; return whether it was kept."""
        s, keyframes = self._settings.search, self._keyframes.setdefault(keyframe.scan.laser, [])
        if keyframes:
            before = keyframes[-1]
            step = between(before.place, keyframe.odometry)
            driven = float(np.hypot(step[0], step[1]))
            waited = (keyframe.scan.stamp_ns - before.scan.stamp_ns) / 1e9
            if driven < s.min_d and abs(step[2]) < s.min_a:
                if waited < s.every_s:
                    return False
                keyframes.pop()  # from the same place, where people may have moved on since
                is_new = self._last is None or before.scan.stamp_ns > self._last.stamp_ns
                keyframe = replace(
                    keyframe,
                    reached=before.place,
                    since_searched=before.since_searched and is_new,
                )
        keyframes.append(keyframe)
        del keyframes[: -s.looks]
        return True

    def follow(self, chosen: int, since_ns: int) -> None:
        """Follow the hypothesis of this number in the last search, from a stamp on."""
        keyframes, last = self.keyframes, self._last
        assert last is not None
        pose, former = last.poses[chosen], keyframes[-1].followed
        poses, log_odds = last.poses, last.log_odds
        if former is not None:
            poses = np.concatenate([poses[~last.is_followed], former[None]])
            log_odds = np.append(log_odds[~last.is_followed], 0.0)
        is_followed = (poses == pose).all(axis=1)
        self._last = Hypotheses(
            last.odometry, poses, log_odds - last.log_odds[chosen], is_followed, last.stamp_ns
        )
        for keyframe in keyframes:
            if keyframe.scan.stamp_ns >= since_ns:
                at = compose(pose, between(keyframes[-1].odometry, keyframe.odometry))
                mine = self._keyframes[keyframe.scan.laser]
                mine[mine.index(keyframe)] = replace(keyframe, followed=at)

    def hypotheses(
        self,
        explained: Callable[[Scan], LogLikelihood],
        rng: np.random.Generator,
        within: FloatArray = SAME,
    ) -> Hypotheses:
        """The places that explain all keyframes best, by the likelihood that ``explained`` gives.

        While a place is followed, the robot may have come elsewhere before each of the keyframes;
        those before are explained from the followed pose. With l_i(x) the log-likelihood of
        keyframe i from a place x, and f the followed place,

        log odds(x) = log sum_k odds_k(x) exp(sum_{i >= k} l_i(x) - l_i(f)).

        A place that the previous search found keeps its odds, plus the evidence of keyframes since,
        from other places: what a place lacks on the map, a robot that stands sees again and again.
        Places within ``within`` (3,) m, m, rad of the followed pose are the followed one.

        Raises BuildingError where the building has no place to search.
        """
        keyframes = self.keyframes
        latest = keyframes[-1]
        steps = [between(latest.odometry, keyframe.odometry) for keyframe in keyframes]
        known = np.empty((0, 3)) if latest.followed is None else latest.followed[None]
        if self._last is not None:
            known = np.concatenate([known, self._last.moved(latest.odometry)])
        found = np.concatenate([known, self._candidates(latest.odometry)])
        if len(found) == 0:
            raise self._nowhere()
        tempering, model = self._settings.localization.tempering, self._settings.beam_model
        beams, tables = (
            self._settings.search.max_beams,
            [self._at(keyframe) for keyframe in keyframes],
        )
        views = [explained(keyframe.scan) for keyframe in keyframes]

        def looked_up(k: int, poses: FloatArray, _: float) -> FloatArray:
            points, headings = poses[..., :2].reshape(-1, 2), poses[..., 2].reshape(-1, 1)
            at = points, headings, np.zeros(3)
            log = tables[k].log_likelihood(keyframes[k].scan, model, beams, *at)
            return tempering * log.reshape(poses.shape[:2])

        def exact(k: int, poses: FloatArray, blur: float) -> FloatArray:
            return views[k](poses, blur)

        coarse, fine = (_Joint(keyframes, steps, tables[-1], each) for each in (looked_up, exact))
        score = coarse.log_odds(found[None], 0.0)[0]
        score[: len(known)] += score.max() - score.min()  # they aren't removed before refinement
        found = _distinct(found, score, HYPOTHESES + len(known))
        own = -np.inf if latest.followed is None else 0.0
        poses, score = _refined(found, fine.log_odds, own, rng)
        poses = poses[np.argsort(-score, kind="stable")]
        poses = poses[_distinct_indices(poses, HYPOTHESES)]
        is_followed = np.zeros(len(poses), dtype=bool)
        if latest.followed is not None:
            is_followed = np.all(np.abs(_off(poses, latest.followed)) <= within, axis=1)
        for pose in poses[is_followed]:
            fine.refine(pose, FINEST)
        gained = fine.gained(poses[:, None], FINEST)
        log_odds = fine.log_odds_by(gained, poses[:, None])[:, 0]
        carried = np.exp(fine.log_odds_by(gained, poses[:, None], carried=True)[:, 0] - log_odds)
        own = log_odds[is_followed].max(initial=0.0)
        outside = fine.outside(FINEST) - own
        log_odds -= own
        if self._last is not None:
            last_ns = self._last.stamp_ns
            later = [each.scan.stamp_ns > last_ns and each.since_searched for each in keyframes]
            since = gained[later].sum(axis=0)[:, 0]
            if is_followed.any():  # they follow the odometry like the others
                since -= since[is_followed].max()
            kept = self._kept(self._last, poses) + since
            log_odds = np.maximum(log_odds, kept - kept[is_followed].max(initial=0.0))
        order = np.argsort(-log_odds, kind="stable")
        self._last = Hypotheses(
            latest.odometry,
            poses[order],
            log_odds[order],
            is_followed[order],
            latest.scan.stamp_ns,
            outside,
            carried[order],
            len(keyframes),
        )
        return self._last

    def _kept(self, last: Hypotheses, poses: FloatArray) -> FloatArray:
        """Log odds (p,) of places (p, 3) in the previous search."""
        former = last.moved(self.keyframes[-1].odometry)
        kept = np.full(len(poses), -np.inf)
        for h, pose in enumerate(poses):
            near = ~last.is_followed & (apart(former, pose) <= 1.0)
            kept[h] = last.log_odds[near].max(initial=-np.inf)
        return kept

    def _candidates(self, odometry: FloatArray) -> FloatArray:
        """Poses that fit the latest scan of each laser best, over all free places and headings."""
        latest, s = [keyframes[-1] for keyframes in self._keyframes.values()], self._settings
        tables = [self._at(keyframe) for keyframe in latest]
        points = next((each for each in tables if len(each.points)), tables[0]).points
        score = np.zeros((len(points), TURNS))
        for keyframe, table in zip(latest, tables, strict=True):
            step = between(odometry, keyframe.odometry)
            at = points, HEADINGS[None], step
            score += table.log_likelihood(keyframe.scan, s.beam_model, s.search.max_beams, *at)
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

    def _at(self, keyframe: Keyframe) -> Places:
        """The places as seen by a laser at a keyframe's height."""
        height = float(np.median(keyframe.scan.rays.origins[:, 2]))
        key = round(height / HEIGHT_STEP)
        if key not in self._places:
            walls = self._sensing.walls_at(height)
            self._places[key] = Places.of(walls, self._settings.search)
        return self._places[key]


def _listed(heights: list[float]) -> str:
    return " and ".join(f"{height:.1f}" for height in heights)


def _off(poses: FloatArray, pose: FloatArray) -> FloatArray:
    """Differences (..., 3) of poses from another, or from others."""
    off = poses - pose
    off[..., 2] = wrap(off[..., 2])
    return off


def apart(a: FloatArray, b: FloatArray) -> FloatArray:
    """Distances between poses (..., 3) in units of ``APART``."""
    return np.asarray((np.abs(_off(a, b)) / APART).max(axis=-1))


class _Priors:
    """Log odds of having come elsewhere before each of several keyframes."""

    def __init__(self, odds: list[Odds], followed: list[FloatArray], places: Places) -> None:
        kidnapped, slipped, width = np.array(odds).T[..., None]  # (k, 1)
        self._followed = np.array(followed)[:, None]  # (k, 1, 3)
        cell = places.spacing**2 * 2.0 * np.pi / TURNS
        self._kidnapped = kidnapped / max(len(places.points) * TURNS, 1)
        self._slipped = slipped, cell / (np.pi**2 * SLIP_M**2 * SLIP_RAD)
        self._is_wide, self._width = width > 0.0, np.where(width > 0.0, width, 1.0)

    @property
    def carried(self) -> FloatArray:
        """(k, 1) of its having been carried to any pose, as wide as a cell of the grid."""
        return np.asarray(np.log(np.maximum(self._kidnapped, NEVER)))

    def __call__(self, poses: FloatArray) -> FloatArray:
        """(k, p) of the robot's being at poses (p, 3), each as wide as a cell of the search's grid.

        A slip has a Student distribution about the followed pose with one degree of freedom, in
        metres and radians. A wide belief has narrowed to one of the places within its width, with
        the same probability for each of them.
        """
        off = _off(poses, self._followed)
        squared, turned = (off[..., :2] ** 2).sum(axis=2), (off[..., 2] / SLIP_RAD) ** 2
        near = 1.0 / (1.0 + squared / SLIP_M**2 + turned) ** 2
        slipped, density = self._slipped
        odds = self._kidnapped + slipped * near * density
        odds += self._is_wide / (1.0 + squared / self._width**2 + turned) ** 2
        return np.asarray(np.log(np.maximum(odds, NEVER)))


class _Joint:
    """The odds of places relative to the followed one, by several keyframes together."""

    def __init__(
        self,
        keyframes: list[Keyframe],
        steps: list[FloatArray],
        places: Places,
        log_likelihood: Callable[[int, FloatArray, float], FloatArray],
    ) -> None:
        self._keyframes, self._steps, self._places = keyframes, np.array(steps), places
        self._log_likelihood = log_likelihood  # of a keyframe, see ``LogLikelihood``
        self._own: dict[tuple[int, float], float] = {}

    def log_odds(self, poses: FloatArray, blur: float) -> FloatArray:
        """Log odds (h, p) of poses (h, p, 3) at the last keyframe, each row close together."""
        return self.log_odds_by(self.gained(poses, blur), poses)

    def log_odds_by(
        self, gained: FloatArray, poses: FloatArray, *, carried: bool = False
    ) -> FloatArray:
        """The same by what the keyframes have ``gained`` (k, h, p), or of being carried alone."""
        keyframes = self._keyframes
        since = gained[::-1].cumsum(axis=0)[::-1]
        if keyframes[-1].followed is None:
            cells = max(len(self._places.points), 1) * TURNS
            return np.asarray(since[0] - np.log(cells))
        if carried:
            priors = self._priors.carried[..., None]
        else:
            priors = self._priors(poses.reshape(-1, 3)).reshape(since.shape)
        return np.asarray(np.logaddexp.reduce(priors + since, axis=0))

    @lazy
    def _priors(self) -> _Priors:
        keyframes = self._keyframes
        odds = [
            keyframes[0].before.plus(keyframes[0].since),
            *(keyframe.since for keyframe in keyframes[1:]),
        ]
        # the last keyframe at the followed place
        anchors = [keyframes[max(k - 1, 0)] for k in range(len(keyframes))]
        return _Priors(odds, [self._driven_on(anchor) for anchor in anchors], self._places)

    def refine(self, pose: FloatArray, blur: float) -> None:
        """Evaluate the followed place also at a pose (3,) that was refined as other places are."""
        for k, step in enumerate(self._steps):
            refined = float(self._log_likelihood(k, compose(pose, step)[None, None], blur)[0, 0])
            self._own[k, blur] = max(self._known(k, blur), refined)

    def outside(self, blur: float) -> float:
        """Log odds of a place that the map doesn't show, where scans read what is usual."""
        keyframes = self._keyframes
        if keyframes[-1].followed is None:
            return float(np.log(OUTSIDE))
        gained = INDEPENDENCE * np.array(
            [keyframe.chance - self._known(k, blur) for k, keyframe in enumerate(keyframes)]
        )
        kidnapped = [keyframes[0].before.kidnapped, *(0.0 for _ in keyframes[1:])]
        odds = np.array([keyframe.since.kidnapped for keyframe in keyframes]) + np.array(kidnapped)
        prior = np.log(np.maximum(OUTSIDE * odds, NEVER))
        return float(np.logaddexp.reduce(prior + gained[::-1].cumsum()[::-1]))

    def gained(self, poses: FloatArray, blur: float) -> FloatArray:
        """Log-likelihood ratios (k, h, p) of the keyframes, of poses (h, p, 3) as above."""
        at = compose(poses, self._steps[:, None, None])  # (k, h, p, 3)
        gained = [
            self._log_likelihood(k, at[k], blur) - self._known(k, blur) for k in range(len(at))
        ]
        return INDEPENDENCE * np.array(gained)

    def _driven_on(self, keyframe: Keyframe) -> FloatArray:
        """The pose (3,) that was followed at a keyframe, moved on to the last one."""
        followed = self._keyframes[-1].followed if keyframe.followed is None else keyframe.followed
        assert followed is not None
        return compose(followed, between(keyframe.odometry, self._keyframes[-1].odometry))

    def _known(self, k: int, blur: float) -> float:
        """Log-likelihood of a keyframe from the followed pose, or by chance without one."""
        if (k, blur) not in self._own:
            followed = self._keyframes[k].followed
            self._own[k, blur] = (
                self._keyframes[k].chance
                if followed is None
                else float(self._log_likelihood(k, followed[None, None], blur)[0, 0])
            )
        return self._own[k, blur]


def _distinct(poses: FloatArray, score: FloatArray, most: int) -> FloatArray:
    """The best of the poses (p, 3) that are different hypotheses."""
    ordered = poses[np.argsort(-score, kind="stable")]
    return ordered[_distinct_indices(ordered, most)]


def _distinct_indices(poses: FloatArray, most: int) -> list[int]:
    """Indices of the poses (p, 3) that differ from all before them, at most so many."""
    kept: list[int] = []
    free = np.ones(len(poses), dtype=bool)
    while free.any() and len(kept) < most:
        kept.append(int(np.argmax(free)))
        free &= apart(poses, poses[kept[-1]]) > 1.0
    return kept


def _refined(
    poses: FloatArray, joint: LogLikelihood, own: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """The best poses near poses (h, 3), by ever smaller steps, and their log odds (h,).

    All are refined with the same steps, so that none has better luck than others that look alike.
    ``own`` are the log odds of the followed place.
    """
    poses, score = poses.copy(), np.full(len(poses), own)
    for step in STEPS:
        off = rng.standard_normal((TRIES, 3)) * SPREAD * step
        off[0] = 0.0
        rows = np.flatnonzero(score >= max(own, score.max()) - HOPELESS)
        if len(rows) == 0:
            break
        blur = step * float(SPREAD[0]) / 2.0
        found = joint(poses[rows, None] + off, blur)
        weights = np.exp(found - found.max(axis=1, keepdims=True))
        mean = poses[rows] + weights @ off / weights.sum(axis=1, keepdims=True)
        best, of_mean = found.max(axis=1), joint(mean[:, None], blur)[:, 0]
        nearest = poses[rows] + off[found.argmax(axis=1)]
        poses[rows] = np.where((of_mean > best)[:, None], mean, nearest)
        score[rows] = np.maximum(of_mean, best)
    return poses, score
