"""Where doors come to rest: closed, open as far as they go, or anywhere between.

A mixture of a peak at each limit and an even density, whose shares are learnt by
expectation-maximization under a Dirichlet prior.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.geometry import FloatArray
from objstate.learning.rests import Rest

PEAK_DEG = 5.0  # deg, deviation of a peak at a limit
PEAK_M = 0.03  # m, the same of sliding doors
PRIOR_RESTS = 3.0  # rests that the prior weighs as much as
EVENLY = (1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0)
ROUNDS = 200  # of expectation and maximization; each is a few operations


@dataclass(frozen=True)
class RestShares:
    """Shares of rests; they sum to one."""

    closed: float
    open: float
    anywhere: float
    rests: int  # that they were learnt from

    def to_dict(self) -> dict[str, float]:
        """As a setting has them; rounded down, so that some are left for anywhere."""
        return {name: math.floor(1e3 * getattr(self, name)) / 1e3 for name in ("closed", "open")}


def learn_shares(
    doors: Sequence[tuple[MovableObject, Rest]], prior: Sequence[float] = EVENLY
) -> RestShares:
    """Shares after rests of doors with two limits; ``prior`` (3,) are the shares assumed before."""
    densities = np.array([_densities(item, rest) for item, rest in doors]).reshape(-1, 3)
    before = PRIOR_RESTS * np.asarray(prior) / np.sum(prior)
    shares = before / before.sum()
    for _ in range(ROUNDS):
        joint = shares * densities
        counts = before + (joint / joint.sum(axis=1, keepdims=True)).sum(axis=0)
        shares = counts / counts.sum()
    closed, wide, anywhere = shares.tolist()
    return RestShares(closed, wide, anywhere, len(densities))


def _densities(item: MovableObject, rest: Rest) -> FloatArray:
    """(3,) density of a rest's state where it is closed, open, anywhere."""
    peak = np.radians(PEAK_DEG) if item.kind is Kind.HINGED else PEAK_M
    width = float(np.hypot(peak, rest.std[0]))
    state, span = float(rest.state[0]), item.upper - item.lower
    # peaks are folded at their limits, beyond which no state is
    heights = [
        2.0 * np.exp(-0.5 * ((state - limit) / width) ** 2) / (width * np.sqrt(2.0 * np.pi))
        for limit in (item.lower, item.upper)
    ]
    return np.array([*heights, 1.0 / span])
