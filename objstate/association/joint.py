"""Joint association of objects that look alike: hypotheses of which object is where.

Multiple hypothesis tracking (D. B. Reid, "An algorithm for tracking multiple targets", IEEE Trans.
Automatic Control 24 (1979) 843-854) of a known set of objects. Each hypothesis is one history of
assignments. Two that differ only by a permutation are both kept, since no later reading
distinguishes objects that look alike: their weights give the probability that identities were
swapped.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from objstate.association.assignments import assignments
from objstate.association.motion import STATE, Motion, Tracks
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from scipy import optimize
else:
    optimize = Later("scipy.optimize")

MOST = 40  # hypotheses kept
LEAST = 1e-9  # weight of a hypothesis that is kept, relative to the best
ALIKE = 0.5  # squared Mahalanobis distance, by coordinate, of two hypotheses' states that are one
# 1/m^2: density with which an object that went out of sight appears at an unexpected place
CARRIED = 1e-3
FOUND = 0.01  # m, sigma of its place then
UNLIKELY = 1e-6  # least probability of being seen, and of being missed


@dataclass(frozen=True, eq=False)
class Readings:
    """The readings of objects that look alike."""

    positions: FloatArray  # (m, 2) m
    covariances: FloatArray  # (m, 2, 2) m^2
    clutter: float = 0.01  # readings of nothing, to the square metre


@dataclass(frozen=True, eq=False)
class Joint:
    """Beliefs of where k objects are that look alike."""

    weights: FloatArray  # (h,), which sum to one, the largest first
    tracks: Tracks = field(repr=False)  # (h, k)
    unseen: IntArray = field(repr=False)  # (h, k) number of observations since it was read
    spacing: float  # m, nearer than which the middles of two never are

    @staticmethod
    def at(positions: FloatArray, std: float, motion: Motion, spacing: float) -> Joint:
        """Objects at positions (k, 2), known to ``std`` m, with their identities."""
        tracks = Tracks.at(positions[None], std, motion)
        return Joint(np.ones(1), tracks, np.zeros((1, len(positions)), int), spacing)

    @property
    def best(self) -> Tracks:
        """(k,) of the most probable hypothesis."""
        return self.tracks[0]

    def moving(self, motion: Motion) -> Joint:
        """The same, of objects that move otherwise from now on."""
        return replace(self, tracks=replace(self.tracks, motion=motion))

    def predicted(self, step: float) -> Joint:
        """A step of ``step`` seconds later."""
        return replace(self, tracks=self.tracks.predicted(step))

    def updated(self, readings: Readings, seen: FloatArray) -> Joint:
        """Update by readings; (h, k, m) are probabilities of detection, by hypothesis and mode.

        A reading is of one object or of nothing; an object gives one reading or none. One that
        wasn't read the last time may have been carried anywhere.
        """
        count, objects = len(readings.positions), np.arange(seen.shape[1])
        seen = np.clip(seen, UNLIKELY, 1.0 - UNLIKELY)
        waiting, missed = self.tracks.unseen(seen)
        moved, likelihoods = self.tracks[:, :, None].updated(
            readings.positions, readings.covariances, seen[:, :, None]
        )
        found = Tracks.at(readings.positions, FOUND, self.tracks.motion)[None, None]
        carried = (self.unseen > 0)[..., None] & (likelihoods < np.log(CARRIED))
        likelihoods = np.where(carried, np.log(CARRIED), likelihoods)
        moved = _where(carried, found, moved)
        scores = np.concatenate(
            [likelihoods - np.log(readings.clutter), missed[..., None]], axis=-1
        )
        logs, parents, choices = assignments(np.log(self.weights), scores)
        rows, none = parents[:, None], choices == count
        after = waiting[rows, objects]
        if count:
            after = _where(none, after, moved[rows, objects, np.where(none, 0, choices)])
        unseen = np.where(none, self.unseen[rows, objects] + 1, 0)
        return _reduced(replace(self, tracks=after, unseen=unseen), logs + self._apart(after))

    def identities(self) -> FloatArray:
        """(k, k) probability that a row's object is at the best hypothesis's place of a column's."""
        places = self.best.positions
        found = np.zeros((len(places), len(places)))
        for weight, positions in zip(self.weights, self.tracks.positions, strict=True):
            distances = np.hypot(*np.moveaxis(positions[:, None] - places, -1, 0))
            rows, columns = optimize.linear_sum_assignment(distances)
            found[rows, columns] += weight
        return found

    @property
    def kept(self) -> float:
        """Probability that all objects are the ones that the best hypothesis has them for."""
        return float(self.identities().diagonal().min())

    def _apart(self, tracks: Tracks) -> FloatArray:
        """(h,) log-likelihood that no two objects are in one another."""
        places = tracks.positions
        first, second = np.triu_indices(places.shape[1], 1)
        off = places[:, first] - places[:, second]
        spread = tracks.position_covariance
        sigma = np.sqrt(np.trace(spread[:, first] + spread[:, second], axis1=-2, axis2=-1) / 2.0)
        into = np.maximum(self.spacing - np.hypot(off[..., 0], off[..., 1]), 0.0)
        return np.asarray(-0.5 * ((into / sigma) ** 2).sum(axis=-1))


def _where(first: BoolArray, a: Tracks, b: Tracks) -> Tracks:
    """Tracks (h, k) of one where ``first`` (h, k), of the other elsewhere."""
    return Tracks(
        a.motion,
        np.where(first[..., None], a.chances, b.chances),
        np.where(first[..., None, None], a.means, b.means),
        np.where(first[..., None, None, None], a.covariances, b.covariances),
    )


def _reduced(joint: Joint, logs: FloatArray) -> Joint:
    """Hypotheses of log weights (h,), without improbable ones; equal ones are merged."""
    order = np.argsort(-logs, kind="stable")
    order = order[logs[order] > logs[order[0]] + np.log(LEAST)][: 4 * MOST]
    weights, tracks = np.exp(logs[order] - logs[order[0]]), joint.tracks[order]
    means, covariances = tracks.mean, tracks.covariance
    into = np.arange(len(order))
    inverses = np.linalg.inv(covariances)
    for h in range(1, len(order)):
        kept = np.flatnonzero(into[:h] == np.arange(h))
        off = means[kept] - means[h]
        # by the narrower of both: what is known well isn't what is hardly known
        squared = [
            (off * (inverse @ off[..., None])[..., 0]).sum(axis=-1)
            for inverse in (inverses[kept], inverses[h])
        ]
        same = kept[(np.max(squared, axis=0) / STATE < ALIKE).all(axis=1)]
        if len(same):
            into[h] = same[0]
    total = np.bincount(into, weights, minlength=len(order))
    left = np.flatnonzero(into == np.arange(len(order)))[:MOST]
    left = left[np.argsort(-total[left], kind="stable")]
    share = total[left] / total[left].sum()
    return Joint(share, tracks[left], joint.unseen[order][left], joint.spacing)
