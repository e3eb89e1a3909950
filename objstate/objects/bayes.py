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
    joint = log_likelihood + weights.log
    top = joint.max(axis=1, keepdims=True)
    evidence = top + np.log(np.exp(joint - top).sum(axis=1, keepdims=True))
    votes = log_likelihood - evidence + robot_weights.log[:, None]
    top = votes.max(axis=0)
    return np.asarray(top + np.log(np.exp(votes - top).sum(axis=0)))
