"""Two ways to follow objects that look alike, by light checks of where they are predicted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import process_time
from typing import Protocol

import numpy as np

from objstate.association import Joint, Located, Motion, Readings, Tracks, located, shared_out
from objstate.experiments.elfring2012.looks import Look, Seen
from objstate.geometry import BoolArray, FloatArray, IntArray

SIGMAS = 3.0  # of a position, that its region of interest reaches beyond the object
SOLID = 0.8  # of two radii: middles nearer than that are of one object
CERTAIN = 0.98  # probability that what nothing hides is seen
BARELY = 0.35  # share in sight from which on an object is seen as well as that
HIDDEN = 0.5  # share of an object that is hidden, from which on it isn't missed
TURNS = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
RING = np.column_stack([np.cos(TURNS), np.sin(TURNS)])
MISFIT = 2.5  # sigmas of a reading, beyond which what is seen isn't of such an object
CENTROID_STD = 0.005  # m, of a middle of readings


@dataclass(frozen=True, eq=False)
class Checks:
    """What one round of checks came to."""

    checked: BoolArray  # (k,)
    missing: BoolArray  # (k,) of these, not seen
    hidden: BoolArray  # (k,) of the missing, explained by something before them
    rounds: tuple[int, ...] = ()  # of each k-means
    seconds: float = 0.0  # of processor time


class Tracker(Protocol):
    """A belief of k objects; a step returns the new one."""

    @property
    def tracks(self) -> Tracks:
        """(k,) where the objects are held to be."""
        ...

    @property
    def kept(self) -> float:
        """Probability that none was taken for another, as the tracker sees it."""
        ...

    def predicted(self, step: float) -> Tracker: ...

    def checked(self, look: Look, due: BoolArray) -> tuple[Tracker, Checks]:
        """After checks of the objects (k,) that are due."""
        ...


@dataclass(frozen=True, eq=False)
class KMeans:
    """As in section IV-B.3: pixels shared out by k-means, the objects' own filters."""

    tracks: Tracks = field(repr=False)

    @staticmethod
    def at(positions: FloatArray, std: float, motion: Motion, spacing: float = 0.0) -> KMeans:
        return KMeans(Tracks.at(positions, std, motion))

    @property
    def kept(self) -> float:
        return 1.0  # it has no doubts

    def predicted(self, step: float) -> KMeans:
        return KMeans(self.tracks.predicted(step))

    def checked(self, look: Look, due: BoolArray) -> tuple[KMeans, Checks]:
        begin = process_time()
        chosen = np.flatnonzero(due)
        tracks, positions = self.tracks, self.tracks.positions
        missing, hidden, rounds = np.zeros(len(due), bool), np.zeros(len(due), bool), []
        seen = look.seen(positions[chosen], _reaches(tracks[chosen], look))
        after, codes = [tracks[k] for k in range(len(due))], look.coded(positions)
        for group in _merged(seen.regions):
            members, readings = chosen[group], seen.regions[group].any(axis=0)
            shares = shared_out(seen.codes[readings], codes[members])
            rounds.append(shares.rounds)
            for k, member in enumerate(members.tolist()):
                own = seen.points[readings][shares.labels == k]
                if len(own) < look.fewest:
                    missing[member] = True
                    hidden[member] = _explained(tracks[member], look)
                else:
                    noise = CENTROID_STD**2 * np.eye(2)
                    after[member] = after[member].updated(_middle(own, look), noise)[0]
        checks = Checks(due, missing, hidden, tuple(rounds), process_time() - begin)
        return KMeans(_stacked(after)), checks


@dataclass(frozen=True, eq=False)
class JointTracker:
    """Joint association: circles fitted to what is seen, and hypotheses of whose they are."""

    joint: Joint

    @staticmethod
    def at(positions: FloatArray, std: float, motion: Motion, spacing: float) -> JointTracker:
        return JointTracker(Joint.at(positions, std, motion, spacing))

    @property
    def tracks(self) -> Tracks:
        return self.joint.best

    @property
    def kept(self) -> float:
        return self.joint.kept

    def predicted(self, step: float) -> JointTracker:
        return JointTracker(self.joint.predicted(step))

    def checked(self, look: Look, due: BoolArray) -> tuple[JointTracker, Checks]:
        """All objects as soon as one is due: one that isn't may have given the readings."""
        begin = process_time()
        joint, best = self.joint, self.joint.best
        reaches = _reaches(best, look)
        seen = look.seen(best.positions, reaches)
        # what is out of sight is looked for everywhere: what was there may be anywhere by now
        others = look.elsewhere(best.positions, reaches) if joint.unseen.any() else []
        fits, rounds = _outlines(seen, others, best.positions, look)
        hidden = look.hidden(joint.tracks.corners())
        visible = (CERTAIN * np.minimum((1.0 - hidden) / BARELY, 1.0)).mean(axis=-1)
        after = joint.updated(_readings(fits, look), visible)
        off = [np.hypot(*(fit.position - after.best.positions).T) for fit in fits]
        nearest = np.min(off, axis=0) if fits else np.full(len(due), np.inf)
        missing = nearest > look.radius
        explained = np.zeros(len(due), bool)
        for k in np.flatnonzero(missing).tolist():
            explained[k] = _explained(best[k], look)
        checked = np.ones(len(due), bool)
        return JointTracker(after), Checks(
            checked, missing, explained, (rounds,), process_time() - begin
        )


def _readings(fits: list[Located], look: Look) -> Readings:
    return Readings(
        np.array([fit.position for fit in fits]).reshape(-1, 2),
        np.array([fit.covariance for fit in fits]).reshape(-1, 2, 2),
        look.clutter,
    )


def _outlines(
    seen: Seen, others: list[FloatArray], positions: FloatArray, look: Look
) -> tuple[list[Located], int]:
    """Circles in the readings, as many as there are; and the rounds of k-means that it took.

    Two that overlap are one: solid things don't.
    """
    labels, rounds = seen.runs, 0
    if labels is None:
        shares = shared_out(seen.points, positions)
        labels, rounds = shares.labels, shares.rounds
    parts = [seen.points[labels == k] for k in np.unique(labels).tolist()] + others
    parts = [part for part in parts if len(part) >= look.fewest]
    fits = [_fit(part, look) for part in parts]
    while (pair := _overlapping(fits, look.radius)) is not None:
        parts.append(np.concatenate([parts[k] for k in pair]))
        fits.append(_fit(parts[-1], look))
        for k in sorted(pair, reverse=True):
            del parts[k], fits[k]
    return [fit for fit in fits if fit.misfit < MISFIT * look.noise], rounds


def _fit(points: FloatArray, look: Look) -> Located:
    found = located(points, look.sensor, look.radius, look.noise)
    assert found is not None  # of enough readings
    return found


def _overlapping(fits: list[Located], radius: float) -> tuple[int, int] | None:
    for a in range(len(fits)):
        for b in range(a + 1, len(fits)):
            if np.hypot(*(fits[a].position - fits[b].position)) < SOLID * 2.0 * radius:
                return a, b
    return None


def _explained(tracks: Tracks, look: Look) -> bool:
    """Whether most of an object (no batch axes) may be hidden anywhere in its region."""
    ring = SIGMAS * _widest(tracks) * RING
    places = tracks.positions + np.concatenate([ring, ring / 2.0, np.zeros((1, 2))])
    return bool((look.hidden(places) >= HIDDEN).any())


def _reaches(tracks: Tracks, look: Look) -> FloatArray:
    """(k,) m from the middle of an object, how far its readings may be."""
    return np.asarray(look.radius + 4.0 * look.noise + SIGMAS * _widest(tracks))


def _widest(tracks: Tracks) -> FloatArray:
    """(...) m, sigma of the position in the mode that leaves most open."""
    each = np.trace(tracks.covariances[..., :2, :2], axis1=-2, axis2=-1) / 2.0
    return np.asarray(np.sqrt(each.max(axis=-1)))


def _merged(regions: BoolArray) -> list[IntArray]:
    """Objects whose regions (k, n) share readings, together."""
    shared = (regions.astype(int) @ regions.T.astype(int)) > 0
    labels = np.arange(len(regions))
    for first, second in np.argwhere(np.triu(shared, 1)).tolist():
        labels[labels == labels[second]] = labels[first]
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _middle(points: FloatArray, look: Look) -> FloatArray:
    """(2,) the middle of readings, put back from the side that is seen to the object's middle."""
    middle = points.mean(axis=0)
    away = middle - look.sensor
    return np.asarray(middle + look.setback * away / np.hypot(*away))


def _stacked(tracks: list[Tracks]) -> Tracks:
    first = tracks[0]
    return replace(
        first,
        chances=np.stack([each.chances for each in tracks]),
        means=np.stack([each.means for each in tracks]),
        covariances=np.stack([each.covariances for each in tracks]),
    )
