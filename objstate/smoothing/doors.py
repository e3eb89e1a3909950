"""A door's state at moments of a log, given the whole log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.objects.door_posterior import DoorPosterior
from objstate.objects.mixture import DIRECTIONS, FACTORS, NEVER, Doorway, States, Statics
from objstate.objects.steps import GAP_NS, DoorStep, Step
from objstate.particles import Weights
from objstate.records import NANOSECONDS
from objstate.smoothing.chain import Chain, smoothed_chain

NEGLIGIBLE = 5e-3  # probability of what is static below which it is left out


class DoorHistory(NamedTuple):
    """The stored history of a door, and what is static given the whole log."""

    belief: ObjectBelief  # the last belief, on whose lattice states are published
    steps: list[DoorStep]
    cases: list[tuple[float, Statics]]  # probabilities of the priors of the static errors
    rates: FloatArray  # (r,) of the rates of movements, given the readings of other doors


@dataclass(frozen=True, eq=False)
class SmoothedDoor:
    """p(state | the whole log) of one door."""

    beliefs: list[ObjectBelief]  # at the chains' moments
    # given a prior of the static errors and a rate of movements, with the probability of both
    chains: list[tuple[float, Chain]]

    @property
    def stamps_ns(self) -> IntArray:
        """(n,) the moments."""
        return self.chains[0][1].stamps_ns


@dataclass(frozen=True, eq=False)
class _Filtered:
    """The filtered posterior of a door at moments, given each of some cases of what is static."""

    stamps_ns: IntArray  # (n,)
    resting: FloatArray  # (b, n, c)
    moving: FloatArray  # (b, n, 2 c) up, and down
    means: FloatArray  # (b, n, c) of the state in each component
    variances: FloatArray  # (b, n, c)


class _Statics(NamedTuple):
    """The cases of what is static, each a prior of the static errors and a rate of movements."""

    shares: FloatArray  # (b,) probabilities
    priors: list[Statics]  # (k)
    prior: IntArray  # (b,) the index of each case's prior
    rate: IntArray  # (b,) the index of its factor among ``FACTORS``

    @property
    def factors(self) -> FloatArray:
        """(b, 1)"""
        return FACTORS[self.rate, None]


def smoothed_door(history: DoorHistory, also_ns: Iterable[int] = ()) -> SmoothedDoor:
    """The states of a door at the moments of its steps, and at others far from them.

    What is exact and what is approximate: Given the rate of movements, modes and components are a
    Markov chain, whose backward pass is exact for the filter's posterior (``smoothed_chain``).
    Static errors (hinge, bearing) are summed over their priors given the whole log, and so is the
    rate; each case has a chain of its own. While a door rests in a component, its offset from the
    component's middle is static, so that the Gaussian of the last belief in which it still rested
    there is carried back. That is the Rauch-Tung-Striebel pass of a state without process noise. It
    is approximate where a door may have left or stayed: both cases are merged by mean and variance.
    What is learnt of a hinge's offset after a door was moved doesn't correct its state before.
    """
    moments = moments_of(history.steps, sorted(set(also_ns)))
    door, blank = history.steps[0].door, history.steps[0].blank
    by_stamp = {step.stamp_ns: step.posterior(blank) for step in history.steps}
    statics = _cases(history, by_stamp[history.steps[-1].stamp_ns])
    filtered = _filtered(door, by_stamp, statics, moments)
    chain = smoothed_chain(
        door, filtered.stamps_ns, filtered.resting, filtered.moving, statics.factors
    )
    means, variances = _carried_back(chain, filtered)
    weights, moved = np.zeros((2, len(moments), len(history.belief.states)))
    for case, share in enumerate(statics.shares):
        states = (each[case] for each in (chain.resting, chain.moving, means, variances))
        each, p_moving = door.on_lattice(States(*states), history.belief)
        weights += share * each
        moved += share * each * p_moving
    p_moving = np.minimum(moved / np.maximum(weights, NEVER), 1.0)
    beliefs = [
        altered(
            history.belief,
            weights=Weights(weights[k]),
            p_moving=p_moving[k],
            stamp_ns=moments[k],
            joint=None,
            past=None,
        )
        for k in range(len(moments))
    ]
    shares = statics.shares.tolist()
    return SmoothedDoor(beliefs, [(share, chain.part(k)) for k, share in enumerate(shares)])


def moments_of(steps: Sequence[Step], also_ns: Sequence[int]) -> list[int]:
    """The moments of steps, and those of the others that lie far behind the moment before."""
    own = {step.stamp_ns for step in steps}
    out: list[int] = []
    for stamp in sorted(own | {each for each in also_ns if each > steps[0].stamp_ns}):
        if stamp in own or stamp - out[-1] > GAP_NS:
            out.append(stamp)
    return out


def _cases(history: DoorHistory, last: DoorPosterior) -> _Statics:
    """What is static given all readings; improbable cases are left out."""
    shares, priors = zip(*history.cases, strict=True)
    last = last.under_rates(history.rates)
    states, rates = last.under(priors), last.rates_under(priors)
    given = np.einsum("kc,krc->kr", states.resting, rates[:, 0])
    given += np.einsum("kc,kdrc->kr", states.moving, rates[:, 1:])
    given *= np.array(shares)[:, None]
    prior, rate = np.nonzero(given > NEGLIGIBLE)
    kept = given[prior, rate]
    return _Statics(kept / kept.sum(), list(priors), prior, rate)


def _filtered(
    door: Doorway,
    by_stamp: Mapping[int, DoorPosterior],
    statics: _Statics,
    moments: Sequence[int],
) -> _Filtered:
    """The filtered posterior at moments (n,), predicted where there is no step."""
    shape, count = (len(statics.shares), len(moments)), len(door.states)
    widths = (count, DIRECTIONS * count, count, count)
    arrays = (np.empty((*shape, width)) for width in widths)
    out = _Filtered(np.array(moments, dtype=np.int64), *arrays)
    for k, stamp in enumerate(moments):
        if stamp in by_stamp:
            states = by_stamp[stamp].under(statics.priors)
            rates = by_stamp[stamp].rates_under(statics.priors)[statics.prior, :, statics.rate]
            resting = states.resting[statics.prior] * rates[:, 0]
            moving = states.moving[statics.prior, None] * rates[:, 1:]
            moving = moving.reshape(len(resting), -1)
            total = (resting.sum(axis=-1) + moving.sum(axis=-1))[:, None]
            out.resting[:, k], out.moving[:, k] = resting / total, moving / total
            out.means[:, k] = states.means[statics.prior]
            out.variances[:, k] = states.variances[statics.prior]
            continue
        seconds = (stamp - moments[k - 1]) / NANOSECONDS
        moved = door.moved(out.resting[:, k - 1], out.moving[:, k - 1], seconds, statics.factors)
        arrived = moved.arriving > 0.5
        out.resting[:, k], out.moving[:, k] = moved.resting, moved.moving
        out.means[:, k] = np.where(arrived, door.states, out.means[:, k - 1])
        out.variances[:, k] = np.where(arrived, door.widths, out.variances[:, k - 1])
    return out


def _carried_back(chain: Chain, filtered: _Filtered) -> tuple[FloatArray, FloatArray]:
    """Means and variances (b, n, c) of the state in each component, given the whole log."""
    means, variances = filtered.means.copy(), filtered.variances.copy()
    total = chain.resting + chain.moving
    staying = chain.resting[:, :-1] * chain.stays
    shares = np.divide(
        staying, total[:, :-1], out=np.zeros_like(staying), where=total[:, :-1] > 0.0
    )
    for k in range(means.shape[1] - 2, -1, -1):
        share = shares[:, k]
        off = means[:, k + 1] - filtered.means[:, k]
        means[:, k] = filtered.means[:, k] + share * off
        variances[:, k] = share * variances[:, k + 1] + (1.0 - share) * filtered.variances[:, k]
        variances[:, k] += share * (1.0 - share) * off**2
    return means, variances
