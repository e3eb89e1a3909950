"""Whether a sequence changed its ways once, and when: Bayes factors of one change point.

Without a change, all values come from one distribution whose parameters aren't known; with one,
those before and those after it have parameters of their own. Both marginal likelihoods are known in
closed form: Beta and Bernoulli for states that are open or closed, normal and inverse gamma for
numbers (Murphy 2007, Conjugate Bayesian analysis of the Gaussian distribution, section 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray

PRIOR = 0.05  # probability that there is a change in a sequence at all; anywhere in it as probably
LEAST = 3  # values before a change, and after it
JEFFREYS = 0.5  # of the Beta distribution
WORTH = 0.1  # values that the prior of a mean is worth
SHAPE = 1.0  # of the inverse gamma distribution


@dataclass(frozen=True)
class Change:
    """A possible change."""

    probability: float
    place: int  # the most probable first value after it
    before: float  # mean of the values up to there
    after: float


def change_of_shares(shares: FloatArray, kinds: Sequence[int] | None = None) -> Change | None:
    """A change of shares (n,) in 0..1, each worth one look; None of too few.

    Values of different ``kinds``, as of workdays and weekends, have shares of their own.
    """
    from scipy.special import betaln

    groups = np.zeros(len(shares), dtype=int) if kinds is None else np.asarray(kinds)
    members = groups == np.unique(groups)[:, None]  # (k, n)
    hits, looks = _cumulated(members * shares), _cumulated(members.astype(float))

    def marginal(hit: FloatArray, look: FloatArray) -> FloatArray:
        told = betaln(hit + JEFFREYS, look - hit + JEFFREYS) - betaln(JEFFREYS, JEFFREYS)
        return np.asarray(told.sum(axis=0))

    before = marginal(hits, looks)
    after = marginal(hits[:, -1:] - hits, looks[:, -1:] - looks)
    return _change(shares, before + after)


def change_of_numbers(values: FloatArray) -> Change | None:
    """A change of the mean of numbers (n,); None of too few."""
    from scipy.special import gammaln

    if len(values) < 2 * LEAST:
        return None
    middle, spread = float(np.median(values)), float(np.std(values))
    scaled = (values - middle) / max(spread, np.finfo(float).tiny)
    ones, sums, squares = (_cumulated(each[None])[0] for each in (scaled**0, scaled, scaled**2))

    def marginal(n: FloatArray, s: FloatArray, q: FloatArray) -> FloatArray:
        worth, shape = WORTH + n, SHAPE + n / 2
        rate = SHAPE + (q - s**2 / np.maximum(n, 1)) / 2
        rate = rate + WORTH * s**2 / np.maximum(n, 1) / (2 * worth)
        told = gammaln(shape) - gammaln(SHAPE) + SHAPE * np.log(SHAPE) - shape * np.log(rate)
        return np.asarray(told + (np.log(WORTH) - np.log(worth)) / 2)

    before = marginal(ones, sums, squares)
    after = marginal(ones[-1] - ones, sums[-1] - sums, squares[-1] - squares)
    return _change(values, before + after)


def _cumulated(values: FloatArray) -> FloatArray:
    """(k, n + 1) sums of the first 0, 1, ..., n."""
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(values, axis=1)], axis=1)


def _change(values: FloatArray, parted: FloatArray) -> Change | None:
    """By the log likelihoods (n + 1,) of parting the values after the first 0, 1, ..., n."""
    if len(values) < 2 * LEAST:
        return None
    places = np.arange(LEAST, len(values) - LEAST + 1)
    odds = np.logaddexp.reduce(parted[places]) - np.log(len(places)) - parted[0]
    odds += np.log(PRIOR) - np.log1p(-PRIOR)
    place = int(places[parted[places].argmax()])
    return Change(
        probability=float(1 / (1 + np.exp(-min(odds, 500.0)))) if odds > -500.0 else 0.0,
        place=place,
        before=float(values[:place].mean()),
        after=float(values[place:].mean()),
    )
