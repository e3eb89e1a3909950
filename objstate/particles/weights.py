"""Weights of samples in log space, and operations on them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from objstate.errors import ObjstateError
from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later, lazy

if TYPE_CHECKING:
    from objstate.particles import reweighting
else:
    reweighting = Later("objstate.particles.reweighting")

NEVER = 1e-300  # probability or odds that stand for zero
UNIFORM_KEPT = 16  # number of different sizes that are cached


class ImpossibleEvidenceError(ObjstateError):
    """Every sample has likelihood zero: the evidence contradicts the whole belief."""


@dataclass(frozen=True, eq=False)
class Weights:
    """Normalized importance weights with their logarithms. A value: operations return new ones."""

    values: FloatArray  # (n,) sum to one

    @staticmethod
    @lru_cache(maxsize=UNIFORM_KEPT)
    def uniform(count: int) -> Weights:
        log, values = np.full(count, -math.log(count)), np.full(count, 1.0 / count)
        return Weights._known(values, log, float(count))

    @staticmethod
    def of(weights: FloatArray) -> Weights:
        """From non-negative weights of any sum. Raises ValueError when none is positive."""
        total = float(weights.sum())
        if not (0.0 < total < np.inf and weights.min() >= 0.0):
            raise ValueError("weights must be non-negative, finite and not all zero")
        return Weights(weights / total)

    @staticmethod
    def of_logarithms(log: FloatArray) -> Weights:
        """From the logarithms of weights of any sum, one of which is finite."""
        return Weights._normalized(log)[0]

    def __len__(self) -> int:
        return len(self.values)

    @lazy
    def log(self) -> FloatArray:
        """(n,) logarithms of the weights."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.values))

    @lazy
    def effective_size(self) -> float:
        """Kish's effective number of samples, between 1 and n."""
        return 1.0 / float(self.values @ self.values)

    def reweight(self, log_likelihood: FloatArray) -> tuple[Weights, float]:
        """The weights after evidence (n,), and the log evidence ``log sum_i w_i p(o | i)``.

        Raises ImpossibleEvidenceError when no sample could have produced the evidence.
        """
        weights, log_evidence = Weights._normalized(self.log + log_likelihood)
        if not math.isfinite(log_evidence):
            raise _impossible()
        return weights, log_evidence

    @staticmethod
    def _normalized(log: FloatArray) -> tuple[Weights, float]:
        """Normalized weights of logarithms (n,), and the logarithm of their sum."""
        logarithms, values = np.empty(len(log)), np.empty(len(log))
        log_sum, effective_size = reweighting.normalize(log, logarithms, values)
        return Weights._known(values, logarithms, effective_size), log_sum

    @staticmethod
    def _known(values: FloatArray, log: FloatArray, effective_size: float) -> Weights:
        """Weights whose logarithms are known, also where they underflow."""
        weights: Weights = object.__new__(Weights)
        weights.__dict__.update(values=values, log=log, effective_size=effective_size)
        return weights


def _impossible() -> ImpossibleEvidenceError:
    return ImpossibleEvidenceError(
        "No sample of the belief can explain the reading; give the beam model shares "
        "of random readings and missing returns (z_rand and z_max above 0)."
    )


def largest_step(
    weights: Weights, log_likelihood: FloatArray, most: float, least_effective: float
) -> float:
    """The largest exponent up to ``most`` of a likelihood (n,) with enough effective samples.

    Enough are ``least_effective`` (of samples, or of what is effective already, if
    fewer). It is always above zero, so that repeated steps come to an end.
    """
    return float(reweighting.largest_step(weights.log, log_likelihood, most, least_effective))


def systematic(weights: Weights, count: int, rng: np.random.Generator) -> IntArray:
    """Indices (count,) of a systematic (low-variance) resampling, in ascending order.

    Each sample is drawn ``count`` times its weight on average, never off by one or more.
    """
    return np.asarray(reweighting.systematic(weights.values, count, rng.random()))


def evenly(weights: Weights, count: int) -> IntArray:
    """Indices (count,) of a deterministic systematic sample."""
    return np.asarray(reweighting.systematic(weights.values, count, 0.5))


def quantiles(values: FloatArray, weights: FloatArray, shares: FloatArray) -> FloatArray:
    """Weighted quantiles: each sample's mass is centred on it, and the CDF is linear between.

    ``values`` (n,), ``weights`` (n,) summing to one, ``shares`` (q,) in [0, 1]; returns (q,).
    """
    order = np.argsort(values, kind="stable")
    mass = weights[order]
    return np.interp(shares, np.cumsum(mass) - mass / 2, values[order])


def kld_sample_size(occupied_bins: int, pf_err: float, pf_z: float) -> int:
    """Samples needed for KL error below ``pf_err`` with quantile ``pf_z`` (Fox 2003, eq. 7)."""
    if occupied_bins < 2:
        return 1
    freedom = occupied_bins - 1
    part = 2.0 / (9.0 * freedom)
    return math.ceil(freedom / (2.0 * pf_err) * (1.0 - part + math.sqrt(part) * pf_z) ** 3)


def entropy(weights: FloatArray) -> float:
    """Shannon entropy of discrete weights (n,) in nats."""
    positive = weights[weights > 0]
    return float(-np.sum(positive * np.log(positive)))
