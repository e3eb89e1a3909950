"""Forward filtering, backward smoothing of a door's discrete chain: its modes and components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.objects.mixture import DIRECTIONS, Doorway
from objstate.records import NANOSECONDS


@dataclass(frozen=True, eq=False)
class Chain:
    """p(mode, component | the whole log) at moments, and the probability of staying at rest.

    ``stays`` are probabilities, given the whole log and that the door rests in a component at a
    moment, that it rests there without a break up to the next moment; ``stayed`` are the same for
    the time since the moment before.
    """

    stamps_ns: IntArray  # (n,) ascending
    resting: FloatArray  # (.., n, c) weights; with ``moving`` they sum to one
    moving: FloatArray  # (.., n, c)
    stays: FloatArray  # (.., n - 1, c) from moment k to k + 1, given rest at k
    stayed: FloatArray  # (.., n - 1, c) the same, given rest at k + 1

    def part(self, index: int) -> Chain:
        """One of several chains (b, n, c)."""
        own = (self.resting, self.moving, self.stays, self.stayed)
        return Chain(self.stamps_ns, *(each[index] for each in own))


def smoothed_chain(
    door: Doorway,
    stamps_ns: IntArray,
    resting: FloatArray,
    moving: FloatArray,
    factors: FloatArray | float = 1.0,
) -> Chain:
    """The chain of a door, by its filtered weights (.., n, c) and (.., n, 2 c) at moments (n,).

    With x the mode and component, a_k(x) the filtered weights, and T the transition of
    ``Doorway.moved``, the smoothed weights are (Kitagawa 1987)

        g_k(x) = a_k(x) sum_x' T(x, x') g_k+1(x') / p_k+1(x'),    p_k+1 = a_k T.

    Exact for a chain whose likelihoods depend on x alone. The rate of movements is multiplied by
    ``factors``, one or (.., 1).
    """
    count = len(stamps_ns)
    rest, move = resting.copy(), moving.copy()
    stays = np.zeros((*resting.shape[:-2], max(count - 1, 0), resting.shape[-1]))
    stayed = np.zeros_like(stays)
    for k in range(count - 2, -1, -1):
        seconds = float(stamps_ns[k + 1] - stamps_ns[k]) / NANOSECONDS
        now, then = (..., k, slice(None)), (..., k + 1, slice(None))
        before = door.moved(resting[now], moving[now], seconds, factors)
        ratio_rest = _ratio(rest[then], before.resting)
        ratio_move = _ratio(move[then], before.moving)
        ahead_rest, ahead_move = door.expected(ratio_rest, ratio_move, seconds, factors)
        stay = door.stays(seconds, factors)
        stays[now] = stay * _ratio(ratio_rest, ahead_rest)
        stayed[now] = stay * _ratio(resting[now], before.resting)
        rest[now], move[now] = resting[now] * ahead_rest, moving[now] * ahead_move
        total = rest[now].sum(axis=-1, keepdims=True) + move[now].sum(axis=-1, keepdims=True)
        rest[now], move[now] = rest[now] / total, move[now] / total
    up, down = np.split(move, DIRECTIONS, axis=-1)
    return Chain(stamps_ns, rest, up + down, np.minimum(stays, 1.0), np.minimum(stayed, 1.0))


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    """The quotient, 0 where the denominator is 0."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0.0)
