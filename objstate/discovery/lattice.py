"""The states in which a leaf may stand, and how probable courses of them are.

The state of a leaf that turns is an angle, rad; of one that slides, the share of its width by which
it was slid away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from objstate.discovery import kernels
from objstate.geometry import FloatArray, IntArray
from objstate.objects.doors import AJAR, AJAR_DEG

FLAT = np.radians(172.0)  # stands for all angles of a leaf that lies along the wall
CLOSED, AT_LIMIT, BETWEEN = 0.45, 0.25, 0.3  # where leaves are found
USUAL_LIMIT, USUAL_LIMIT_STD = np.radians(95.0), np.radians(18.0)
OPENS_FLAT = 0.15  # of doors that open as far as the wall


class Rests(NamedTuple):
    """Where leaves of one type come to rest, and how finely their states are summed over."""

    widest: float
    away: float  # from which on a leaf lies along the wall; beyond the widest, the only one there
    step: float
    fine: float  # step about a leaf's states once they are known roughly
    near: float  # so far about them
    latched: float  # share of closed leaves that stand exactly there
    closed_std: float  # of the others
    limit_std: float
    limits: FloatArray  # (u,) where a door may stop
    log_limit: FloatArray  # (u,)


_turns = np.radians(np.arange(60.0, 136.0, 7.5))
_usual = np.exp(-0.5 * ((_turns - USUAL_LIMIT) / USUAL_LIMIT_STD) ** 2)
SWINGS = Rests(
    widest=np.radians(140.0),
    away=FLAT,
    step=np.radians(3.0),
    fine=np.radians(0.75),
    near=np.radians(6.0),
    latched=1.0 / (1.0 + AJAR),
    closed_std=np.radians(AJAR_DEG[1] / 2.0),
    limit_std=np.radians(4.0),
    limits=np.append(_turns, FLAT),
    log_limit=np.log(np.append((1.0 - OPENS_FLAT) * _usual / _usual.sum(), OPENS_FLAT)),
)
SLIDS = Rests(
    widest=1.075,
    away=0.9,
    step=0.05,
    fine=0.0125,
    near=0.1,
    latched=0.0,
    closed_std=0.02,
    limit_std=0.02,
    limits=np.array([0.9, 0.95, 1.0]),
    log_limit=np.full(3, -math.log(3.0)),
)


@dataclass(frozen=True, eq=False)
class Lattice:
    """States in which a leaf may be; of one that turns the last stands for a leaf along the wall.

    A door stops somewhere. It stands closed, or at its limit, or anywhere between.
    """

    angles: FloatArray  # (a,) rad, or shares of the width
    log_prior: FloatArray  # (u, a) of angles, given each limit
    rests: Rests

    @staticmethod
    def of(each: FloatArray, rests: Rests, step: float) -> Lattice:
        """Some of the states that lie ``step`` apart, and a leaf along the wall."""
        half = np.sqrt(np.pi / 2) * rests.closed_std  # the integral
        ajar = CLOSED * (1.0 - rests.latched)
        closed = ajar / half * np.exp(-0.5 * (each / rests.closed_std) ** 2)
        limit = rests.limits[:, None]
        width = np.sqrt(2 * np.pi) * rests.limit_std
        at_limit = AT_LIMIT / width * np.exp(-0.5 * ((each - limit) / rests.limit_std) ** 2)
        between = BETWEEN / limit / (1.0 + np.exp((each - limit) / (rests.limit_std / 2.0)))
        cell = np.where(each > 0.0, step, step / 2.0)  # no door opens beyond closed
        prior = cell * (closed + at_limit + between)
        prior[:, each == 0.0] += CLOSED * rests.latched
        if rests.away > rests.widest:
            beyond = AT_LIMIT + BETWEEN * (1.0 - rests.widest / rests.away)
            flat = np.where(limit < rests.away, 1e-6, beyond)
            each, prior = np.append(each, rests.away), np.hstack([prior, flat])
        return Lattice(each, np.log(prior), rests)

    @property
    def log_limit(self) -> FloatArray:
        """(u,) of limits."""
        return self.rests.log_limit

    def best(self, gain: FloatArray) -> IntArray:
        """(groups,) numbers of the most probable angles of looks, of gains (a, groups)."""
        marginal = np.logaddexp.reduce(self.log_prior + self.log_limit[:, None], axis=0)
        return np.asarray(np.argmax(gain + marginal[:, None], axis=0))

    def about(self, gain: FloatArray) -> Lattice:
        """A finer one about what each look finds best, of gains (a, groups)."""
        best, rests = self.angles[self.best(gain)], self.rests
        fine = np.arange(0.0, rests.widest, rests.fine)
        kept = (np.abs(fine[:, None] - best) <= rests.near).any(axis=1)
        return Lattice.of(fine[kept], rests, rests.fine)

    def log_evidence(
        self, log_map: FloatArray, log_way: FloatArray, gain: FloatArray, stays: FloatArray
    ) -> float:
        """Of looks with gains (k * a, groups): without a thing beside the leaf, then with each.

        The map has the log-likelihood (a,) of angles, and none of the things. ``log_way`` (a,) is
        the log-probability of what is in the way to them.
        """
        prior = self.log_prior + log_way
        first, count = prior + log_map, len(gain) // prior.shape[1]
        if count > 1:
            nowhere = np.full((len(prior), len(gain) - prior.shape[1]), -np.inf)
            first, prior = np.hstack([first, nowhere]), np.tile(prior, count) - math.log(count)
        each = chained(first, prior, gain, stays)
        return float(np.logaddexp.reduce(self.log_limit + each))


@cache
def whole(slides: bool) -> Lattice:
    """All states of a leaf that turns, or slides."""
    rests = SLIDS if slides else SWINGS
    return Lattice.of(np.arange(0.0, rests.widest, rests.step), rests, rests.step)


def chained(
    first: FloatArray, prior: FloatArray, gain: FloatArray, stays: FloatArray
) -> FloatArray:
    """Log evidence (u,) of looks whose log-likelihoods are (s, groups), by states (s,).

    Between looks the state stays with probabilities (groups,), and is drawn anew from the ``prior``
    (u, s) else; ``first`` (u, s) is the log-probability of states in the map, with the map.
    """
    first, prior = np.atleast_2d(first), np.atleast_2d(prior)
    out = np.empty(len(first))
    kernels.chain(first, prior, np.ascontiguousarray(gain), stays, out)
    return out
