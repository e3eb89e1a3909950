"""Forward filtering, backward smoothing of a door's discrete chain: its modes and components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.objects.mixture import Doorway
from objstate.records import NANOSECONDS


@dataclass(frozen=True, eq=False)
class Chain:
    """p(mode, component | the whole log) at moments, and the probability of staying at rest.

    ``stays`` are probabilities, given the whole log and that the door rests in a component at a
    moment, that it rests there without a break up to the next moment; ``stayed`` are the same for
    the time since the moment before.
    """

    stamps_ns: IntArray  # (n,) ascending
    resting: FloatArray  # (n, ..., c) weights; with ``moving`` they sum to one
    moving: FloatArray  # (n, ..., c)
    stays: FloatArray  # (n - 1, ..., c) from moment k to k + 1, given rest at k
    stayed: FloatArray  # (n - 1, ..., c) the same, given rest at k + 1

    def of(self, case: int, pace: int) -> Chain:
        """That of one case and pace, of arrays (n, case, pace, c)."""
        parts = (self.resting, self.moving, self.stays, self.stayed)
        return Chain(self.stamps_ns, *(part[:, case, pace] for part in parts))


def smoothed_chain(
    door: Doorway,
    stamps_ns: IntArray,
    resting: FloatArray,
    moving: FloatArray,
    pace: FloatArray | float = 1.0,
) -> Chain:
    """The chain of a door, by its filtered weights (n, ..., c) at moments (n,).

    The door is moved ``pace`` (...) times as often as set.
    With x the mode and component, a_k(x) the filtered weights, and T the transition of
    ``Doorway.moved``, the smoothed weights are (Kitagawa 1987)

        g_k(x) = a_k(x) sum_x' T(x, x') g_k+1(x') / p_k+1(x'),    p_k+1 = a_k T.

    Exact for a chain whose likelihoods depend on x alone.
    """
    count = len(stamps_ns)
    rest, move = resting.copy(), moving.copy()
    stays = np.zeros((max(count - 1, 0), *resting.shape[1:]))
    stayed = np.zeros_like(stays)
    for k in range(count - 2, -1, -1):
        seconds = float(stamps_ns[k + 1] - stamps_ns[k]) / NANOSECONDS
        stay = door.stays(seconds, pace)
        before = door.moved(resting[k], moving[k], seconds, pace)
        ratio_rest = _ratio(rest[k + 1], before.resting)
        ratio_move = _ratio(move[k + 1], before.moving)
        ahead_rest, ahead_move = door.expected(ratio_rest, ratio_move, seconds, pace)
        stays[k] = stay * _ratio(ratio_rest, ahead_rest)
        stayed[k] = stay * _ratio(resting[k], before.resting)
        rest[k], move[k] = resting[k] * ahead_rest, moving[k] * ahead_move
        total = rest[k].sum(axis=-1, keepdims=True) + move[k].sum(axis=-1, keepdims=True)
        rest[k] /= total
        move[k] /= total
    return Chain(stamps_ns, rest, move, np.minimum(stays, 1.0), np.minimum(stayed, 1.0))


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    """The quotient, 0 where the denominator is 0."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0.0)
