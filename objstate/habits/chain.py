"""The Markov process within a cell of the week, diagonalized.

Between states i and j of different regions the generator has the rate ``mu_i d_j``: mu_i is how
readily a door in i is moved, and d_j where doors come to rest. Within a region there is no way. The
process is reversible, with the stationary distribution d / mu, so that the generator has a
symmetric form and real eigenvalues.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.design import AWAY, BRIEF, BRIEF_FIRST, BRIEF_OTHER, LOCAL, SETTLED
from objstate.units import SECONDS_PER_HOUR

MOST_LOG = 12.0  # log rates and log odds beyond are cut off


class Chain(NamedTuple):
    """Leading axes are batched; s states, u local parameters."""

    leaves: FloatArray  # (..., s) 1/s, mu
    arrives: FloatArray  # (..., s) d, which sums to one
    rates: FloatArray  # (..., s) 1/s, eigenvalues of the generator
    right: FloatArray  # (..., s, s) its right eigenvectors
    left: FloatArray  # (..., s, s) the inverse of those

    def over(self, seconds: FloatArray | float) -> FloatArray:
        """(..., s, s) transition probabilities over a time (...)."""
        kept = np.exp(self.rates * np.asarray(seconds)[..., None])
        return np.asarray(np.clip((self.right * kept[..., None, :]) @ self.left, 0.0, None))

    @property
    def settled(self) -> FloatArray:
        """(..., s) the stationary distribution."""
        weights = self.arrives / self.leaves
        return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


def chain(u: FloatArray) -> Chain:
    """The process of local parameters (..., u)."""
    u = np.clip(u, -MOST_LOG, MOST_LOG)
    leaves, arrives = _leaves(u), _arrives(u)
    root = np.sqrt(leaves * arrives)
    apart = _apart(root.shape[-1])
    form = root[..., :, None] * root[..., None, :] * apart
    states = np.arange(root.shape[-1])
    form[..., states, states] = -leaves * (arrives @ apart)
    rates, turn = np.linalg.eigh(form)
    scale = np.sqrt(arrives / leaves)
    right = turn / scale[..., :, None]
    left = np.swapaxes(turn, -1, -2) * scale[..., None, :]
    return Chain(leaves, arrives, np.minimum(rates, 0.0), right, left)


def slopes(u: FloatArray, of: Chain) -> FloatArray:
    """(..., u, s, s) derivatives of the generator by local parameters, in its eigenvectors."""
    u = np.clip(u, -MOST_LOG, MOST_LOG)
    count, states = u.shape[-1], of.leaves.shape[-1]
    out = np.zeros((*u.shape, states, states))
    share = of.arrives[..., 0::2] + of.arrives[..., 1::2]  # (..., r) of regions
    regions, brief = np.arange(states) // 2, np.arange(states) % 2
    other, ways = regions > 0, of.leaves[..., :, None] * _ways(of.arrives)
    out[..., SETTLED, :, :] = ways * (brief == 0)[:, None]
    out[..., AWAY, :, :] = ways * ((brief == 0) * np.where(other, -0.5, 0.5))[:, None]
    out[..., BRIEF, :, :] = ways * (brief == 1)[:, None]
    for local in range(BRIEF_FIRST, count):
        if local < LOCAL:
            odds = _odds(u[..., local])
            sign = np.where(brief == 1, 1.0, -1.0) * (other == (local == BRIEF_OTHER))
            slope = share[..., regions] * (odds * (1 - odds))[..., None] * sign
        else:
            region = local - LOCAL + 2
            slope = of.arrives * ((regions == region) - 2.0 * share[..., region, None]) * other
        out[..., local, :, :] = of.leaves[..., :, None] * _ways(slope)
    return np.asarray(of.left[..., None, :, :] @ out @ of.right[..., None, :, :])


def _apart(states: int) -> FloatArray:
    """(s, s) 1 where two states are of different regions."""
    region = np.arange(states) // 2
    return np.asarray(region[:, None] != region, dtype=float)


def _ways(arrives: FloatArray) -> FloatArray:
    """(..., s, s) to other regions by ``arrives`` (..., s), with rows that sum to zero."""
    states = np.arange(arrives.shape[-1])
    apart = _apart(len(states))
    out = arrives[..., None, :] * apart
    out[..., states, states] = -(arrives @ apart)
    return np.asarray(out)


def _leaves(u: FloatArray) -> FloatArray:
    regions = u.shape[-1] - LOCAL + 2
    out = np.empty((*u.shape[:-1], 2 * regions))
    out[..., 0] = u[..., SETTLED] + u[..., AWAY] / 2
    out[..., 2::2] = (u[..., SETTLED] - u[..., AWAY] / 2)[..., None]
    out[..., 1::2] = u[..., BRIEF, None]
    return np.asarray(2.0 * np.exp(np.clip(out, -MOST_LOG, MOST_LOG)) / SECONDS_PER_HOUR)


def _arrives(u: FloatArray) -> FloatArray:
    """Half of d is in the first region, so that of two regions each is left at mu / 2."""
    logits = np.concatenate([np.zeros_like(u[..., :1]), u[..., LOCAL:]], axis=-1)
    share = np.exp(logits - logits.max(axis=-1, keepdims=True))
    share /= share.sum(axis=-1, keepdims=True)
    share = np.concatenate([np.ones_like(share[..., :1]), share], axis=-1) / 2.0
    brief = np.repeat(_odds(u[..., BRIEF_OTHER])[..., None], share.shape[-1], axis=-1)
    brief[..., 0] = _odds(u[..., BRIEF_FIRST])
    out = np.stack([share * (1 - brief), share * brief], axis=-1)
    return np.asarray(np.maximum(out.reshape(*share.shape[:-1], -1), 1e-12))


def _odds(logit: FloatArray) -> FloatArray:
    return np.asarray(1.0 / (1.0 + np.exp(-logit)))
