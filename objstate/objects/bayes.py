"""The update of an object's belief by one scan: eqs. (8) and (9), Schulz and Burgard 2001."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray
from objstate.particles import Weights


def marginal_log_likelihood(
    log_likelihood: FloatArray, weights: Weights, robot_weights: Weights
) -> FloatArray:
    """Log of sum_l p(o | s, l) p(l) / p(o | l), for each state (s,).

    ``log_likelihood`` (l, s) is log p(o | s, l), each row up to a constant;
    ``weights`` (s,) are p(s) and ``robot_weights`` (l,) are p(l). Each robot sample
    is normalized by p(o | l) = sum_s p(o | s, l) p(s), eq. (9), so that every one
    votes with its own weight, whatever it explains, eq. (8).
    """
    evidence = _log_sum(log_likelihood + weights.log, axis=1)
    able = np.isfinite(evidence)  # a robot sample from which no state is possible has no vote
    votes = (log_likelihood[able] - evidence[able, None]) + robot_weights.log[able, None]
    return _log_sum(votes, axis=0)


def _log_sum(logs: FloatArray, axis: int) -> FloatArray:
    """Log of the sum of exponentials along an axis; -inf where there is nothing to sum."""
    top = logs.max(axis=axis, initial=-np.inf, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(logs - top).sum(axis=axis)) + top.squeeze(axis))
