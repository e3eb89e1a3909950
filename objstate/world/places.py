"""What drives tell of where furniture stands, put together: what is fixed has one place in all.

A drive's filter knows where a piece stood when it was last seen. Without the prior, that is a
Gaussian likelihood of its place. Whether a piece is fixed, or was moved between drives, is told by
the marginal likelihoods of both: one place for all drives, with a small error of each, or a place
of its own in each.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.config import FurnitureSettings, Settings
from objstate.geometry import FloatArray, rotation_about, transform, wrap
from objstate.objects import ObjectBelief
from objstate.objects.furniture_mixture import Piece

OWN_STD = np.array([0.01, 0.01, math.radians(1.0)])  # m, m, rad: a drive's own error of a place
FIXED = 0.5  # probability of a piece before drives, and from which it counts as fixed
LEAST_PRESENCE = 1e-6
MOST_ODDS = 700.0  # logarithm; exp(-700) is still a number
LEAST_DRIVES = 2  # that can tell whether a piece was moved


@dataclass(frozen=True, eq=False)
class PlaceEvidence:
    """What one drive tells of a piece's place, about the model's: a likelihood without a prior."""

    information: FloatArray  # (3, 3) of x, y in m and yaw in rad
    pull: FloatArray  # (3,) that times the offset from the model
    prior: FloatArray  # (3, 3) covariance about the model of a piece that is moved about
    presence: float  # probability that it was there

    @staticmethod
    def of(belief: ObjectBelief, settings: FurnitureSettings) -> PlaceEvidence:
        """What a filter knows at the end of a drive."""
        prior, item = Piece(belief.item, settings).prior_covariance, belief.item
        off = belief.mean - item.home
        off[2] = wrap(off[2])
        each = belief.deviations
        covariance = (belief.weights.values[:, None] * each).T @ each + np.diag(OWN_STD**2)
        told = np.linalg.inv(covariance)
        values, vectors = np.linalg.eigh(told - np.linalg.inv(prior))
        information = (vectors * values.clip(min=0.0)) @ vectors.T
        mean = np.linalg.solve(information + 1e-9 * np.eye(3), told @ off)
        return PlaceEvidence(information, information @ mean, prior, belief.presence)

    def beside(self, off: FloatArray) -> PlaceEvidence:
        """The same about a model, where this is about one that is off it by so much (3,)."""
        return replace(self, pull=self.pull + self.information @ off)

    def words(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "information": self.information.round(3).tolist(),
            "pull": self.pull.round(4).tolist(),
            "prior_std": np.sqrt(np.diag(self.prior)).round(6).tolist(),
            "presence": round(self.presence, 6),
        }

    @staticmethod
    def read(words: Mapping[str, Any]) -> PlaceEvidence:
        """Raises KeyError, TypeError or ValueError for what isn't such words."""
        information, pull, std = (
            np.array(words[name], dtype=float) for name in ("information", "pull", "prior_std")
        )
        if (information.shape, pull.shape, std.shape) != ((3, 3), (3,), (3,)):
            raise ValueError("the evidence has another form")
        return PlaceEvidence(information, pull, np.diag(std**2), float(words["presence"]))


Places = Mapping[str, PlaceEvidence]  # by piece


@dataclass(frozen=True, eq=False)
class PlaceStatics:
    """The posterior of one piece's place, if it is fixed."""

    name: str
    drives: int  # that saw it
    fixed: float  # probability
    moved: FloatArray  # (3,) m, m, rad, offset from the model
    covariance: FloatArray  # (3, 3)

    @property
    def is_fixed(self) -> bool:
        """Whether it probably stands in one place."""
        return self.fixed > FIXED

    @property
    def std(self) -> FloatArray:
        """(3,) m, m, rad"""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def place_std(self) -> float:
        """m, the root mean square over both directions."""
        return math.sqrt(float(np.mean(np.diag(self.covariance)[:2])))


def places_of(beliefs: Mapping[str, ObjectBelief], settings: Settings) -> dict[str, PlaceEvidence]:
    """What a drive told of the furniture that it passed, by its beliefs at the end."""
    out = {}
    for name, belief in sorted(beliefs.items()):
        if belief.item.kind is Kind.PLANAR and belief.last_observed_ns is not None:
            chosen = settings.for_object(name, "furniture")
            assert isinstance(chosen, FurnitureSettings)
            out[name] = PlaceEvidence.of(belief, chosen)
    return out


def put_together(drives: Sequence[Places]) -> list[PlaceStatics]:
    """The posterior of each piece that at least two drives tell of, in the order of their names."""
    names = sorted({name for drive in drives for name in drive})
    told = {name: [drive[name] for drive in drives if name in drive] for name in names}
    return [_posterior(name, each) for name, each in told.items() if len(each) >= LEAST_DRIVES]


def _posterior(name: str, drives: Sequence[PlaceEvidence]) -> PlaceStatics:
    information = np.sum([each.information for each in drives], axis=0)
    pull = np.sum([each.pull for each in drives], axis=0)
    odds = _log_evidence(information, pull, drives[0].prior)
    for each in drives:
        odds -= _log_evidence(each.information, each.pull, each.prior)
        odds += math.log(max(each.presence, LEAST_PRESENCE))  # what is fixed is always there
    odds = min(odds, MOST_ODDS)
    # causes of a drive's own error, such as legs that are thicker, are there in all drives
    shared = np.linalg.inv(np.eye(3) + information @ np.diag(OWN_STD**2))
    information, pull = shared @ information, shared @ pull
    covariance = np.asarray(np.linalg.inv(information + np.linalg.inv(drives[0].prior)))
    return PlaceStatics(
        name, len(drives), 1.0 / (1.0 + math.exp(-odds)), covariance @ pull, covariance
    )


def _log_evidence(information: FloatArray, pull: FloatArray, prior: FloatArray) -> float:
    """log p(z) with the place integrated out under its prior, beside that at the best place."""
    total = information + np.linalg.inv(prior)
    _, log_det = np.linalg.slogdet(np.eye(3) + prior @ information)
    return 0.5 * (float(pull @ np.linalg.solve(total, pull)) - float(log_det))


def placed(building: Building, pieces: Sequence[PlaceStatics]) -> Building:
    """The building with its fixed furniture where it was learnt to stand."""
    moved = {
        each.name: _placed(building.objects[each.name], each.moved)
        for each in pieces
        if each.is_fixed
    }
    return replace(building, objects={**building.objects, **moved})


def _placed(item: MovableObject, off: FloatArray) -> MovableObject:
    """A piece that stands elsewhere."""
    turn = transform(rotation_about((0.0, 0.0, 1.0), float(off[2])), np.zeros(3))
    origin = turn @ item.origin
    origin[:3, 3] = item.origin[:3, 3] + np.array([off[0], off[1], 0.0])
    return replace(item, origin=origin)
