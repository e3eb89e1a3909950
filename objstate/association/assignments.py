"""Ways to give readings to objects: each reading to one object at most, each object one reading or none."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray, IntArray

WIDEST = 400  # partial assignments that are gone on with
IMPOSSIBLE = -1e9


def assignments(
    log_weights: FloatArray, scores: FloatArray
) -> tuple[FloatArray, IntArray, IntArray]:
    """The best ways to give m readings to k objects, under each of h hypotheses.

    Object by object; of what is possible with those so far, the best are gone on with. With
    few objects and readings that is all there is.

    Args:
        log_weights: (h,) of the hypotheses.
        scores: (h, k, m + 1) log-likelihood ratios of a reading's being of an object and of nothing; the
            last: of its giving none.

    Returns:
        Logs (a,), the hypotheses (a,) that they are of, and which reading each object gave (a, k); m: none.
    """
    hypotheses, objects, columns = scores.shape
    logs, parents = log_weights.copy(), np.arange(hypotheses)
    choices, used = np.zeros((hypotheses, 0), int), np.zeros((hypotheses, columns), bool)
    for k in range(objects):
        grown = logs[:, None] + np.where(used, IMPOSSIBLE, scores[parents, k])
        order = np.argsort(-grown, axis=None, kind="stable")[:WIDEST]
        order = order[grown.ravel()[order] > IMPOSSIBLE / 2.0]
        rows, chosen = np.unravel_index(order, grown.shape)
        logs, parents = grown[rows, chosen], parents[rows]
        choices = np.concatenate([choices[rows], chosen[:, None]], axis=1)
        used = used[rows]
        used[np.arange(len(rows)), chosen] = chosen < columns - 1  # any number may be missed
    return logs, parents, choices


def marginals(scores: FloatArray) -> tuple[FloatArray, float]:
    """How probably each object gave each reading: (k, m + 1), rows sum to one; and the best way's probability.

    Joint probabilistic data association (Fortmann, Bar-Shalom and Scheffe 1983), by scores (k, m +
    1).
    """
    logs, _, choices = assignments(np.zeros(1), scores[None])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    found = np.zeros(scores.shape)
    for k in range(len(scores)):
        np.add.at(found[k], choices[:, k], weights)
    return found, float(weights.max())
