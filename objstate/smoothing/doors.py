"""A door's state at moments of a log, given the whole log."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.objects.mixture import PACES, States, Statics
from objstate.objects.steps import GAP_NS, DoorStep, Step
from objstate.particles import Weights
from objstate.records import NANOSECONDS
from objstate.smoothing.chain import Chain, smoothed_chain


class DoorHistory(NamedTuple):
    """The stored history of a door, and its static errors given the whole log."""

    belief: ObjectBelief  # the last belief, on whose lattice states are published
    steps: list[DoorStep]
    cases: list[tuple[float, Statics]]  # probabilities of the priors of the static errors
    paces: FloatArray  # (p,) probabilities of ``PACES`` given the whole log


@dataclass(frozen=True, eq=False)
class SmoothedDoor:
    """p(state | the whole log) of one door."""

    beliefs: list[ObjectBelief]  # at the chains' moments
    # under each prior of the static errors and pace, with its probability
    chains: list[tuple[float, Chain]]
    presence: float  # probability that beams meet the leaf; the chains are given that they do

    @property
    def stamps_ns(self) -> IntArray:
        """(n,) the moments."""
        return self.chains[0][1].stamps_ns


@dataclass(frozen=True, eq=False)
class _Filtered:
    """The filtered posterior of a door at moments, under each prior of its static errors."""

    stamps_ns: IntArray  # (n,)
    resting: FloatArray  # (n, k, p, c) weights under each pace
    moving: FloatArray  # (n, k, p, c)
    means: FloatArray  # (n, k, c) of the state in each component
    variances: FloatArray  # (n, k, c)


def smoothed_door(history: DoorHistory, also_ns: Iterable[int] = ()) -> SmoothedDoor:
    """The states of a door at the moments of its steps, and at others far from them.

    What is exact and what is approximate: Modes and components are a Markov chain, whose backward
    pass is exact for the filter's posterior (``smoothed_chain``). Static errors (hinge, bearing)
    are summed over their priors given the whole log, and so is the pace at which the door is moved:
    each prior and pace has a chain of its own. Whether beams meet the leaf at all is as probable as
    in the last belief; else readings tell nothing. While a door rests in a component, its offset
    from the component's middle is static, so that the Gaussian of the last belief in which it still
    rested there is carried back. That is the Rauch-Tung-Striebel pass of a state without process
    noise. It is approximate where a door may have left or stayed: both cases are merged by mean and
    variance. What is learnt of a hinge's offset after a door was moved doesn't correct its state
    before.
    """
    moments = moments_of(history.steps, sorted(set(also_ns)))
    shape = len(moments), len(history.belief.states)
    weights, moved = np.zeros(shape), np.zeros(shape)
    door = history.steps[0].door
    priors, chains = [statics for _, statics in history.cases], list[tuple[float, Chain]]()
    filtered = _filtered(history, priors, moments)
    every = smoothed_chain(
        door, filtered.stamps_ns, filtered.resting, filtered.moving, PACES[:, None]
    )
    gaussians = _carried_back(every, filtered, history.paces)
    for case, (share, _) in enumerate(history.cases):
        chains += [(share * p, every.of(case, k)) for k, p in enumerate(history.paces)]
        modes = (history.paces @ part[:, case] for part in (every.resting, every.moving))
        states = States(*modes, *(np.ascontiguousarray(part[:, case]) for part in gaussians))
        each, p_moving = door.on_lattice(states, history.belief)
        weights += share * each
        moved += share * each * p_moving
    presence = history.belief.presence
    weights, p_moving = door.published(weights, moved, presence)
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
    return SmoothedDoor(beliefs, chains, presence)


def moments_of(steps: Sequence[Step], also_ns: Sequence[int]) -> list[int]:
    """The moments of steps, and those of the others that lie far behind the moment before."""
    own = {step.stamp_ns for step in steps}
    out: list[int] = []
    for stamp in sorted(own | {each for each in also_ns if each > steps[0].stamp_ns}):
        if stamp in own or stamp - out[-1] > GAP_NS:
            out.append(stamp)
    return out


def _filtered(history: DoorHistory, priors: Sequence[Statics], moments: Sequence[int]) -> _Filtered:
    """The filtered posterior at moments (n,), predicted where there is no step."""
    by_stamp = {step.stamp_ns: step for step in history.steps}
    door, blank = history.steps[0].door, history.steps[0].blank
    shape, count = (2, len(moments), len(priors)), len(door.states)
    weights, gaussians = np.empty((*shape, len(PACES), count)), np.empty((*shape, count))
    out = _Filtered(np.array(moments, dtype=np.int64), *weights, *gaussians)
    for k, stamp in enumerate(moments):
        if stamp in by_stamp:
            states = by_stamp[stamp].posterior(blank).by_pace_under(priors)
            out.resting[k], out.moving[k], out.means[k], out.variances[k] = states
            continue
        seconds = (stamp - moments[k - 1]) / NANOSECONDS
        each = door.moved(out.resting[k - 1], out.moving[k - 1], seconds, PACES[:, None])
        arrived = each.averaged(history.paces).arriving > 0.5
        out.resting[k], out.moving[k] = each.resting, each.moving
        out.means[k] = np.where(arrived, door.states, out.means[k - 1])
        out.variances[k] = np.where(arrived, door.widths[: len(door.states)], out.variances[k - 1])
    return out


def _carried_back(
    chain: Chain, filtered: _Filtered, paces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Means and variances (n, k, c) of the state in each component, given the whole log."""
    means, variances = filtered.means.copy(), filtered.variances.copy()
    for k in range(len(means) - 2, -1, -1):
        total = paces @ (chain.resting[k] + chain.moving[k])
        stays = paces @ (chain.resting[k] * chain.stays[k])
        share = np.divide(stays, total, out=np.zeros_like(total), where=total > 0.0)
        off = means[k + 1] - filtered.means[k]
        means[k] = filtered.means[k] + share * off
        variances[k] = share * variances[k + 1] + (1.0 - share) * filtered.variances[k]
        variances[k] += share * (1.0 - share) * off**2
    return means, variances
