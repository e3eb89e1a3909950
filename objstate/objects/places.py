"""Where samples of furniture gather: places that compete, each with its own spread."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray, IntArray, square_root
from objstate.objects.belief import SETTLED_ANGLE, SETTLED_LENGTH
from objstate.particles import entropy

# Cells in which samples are counted: what is settled fills few of them.
BIN = 2.0 * np.array([SETTLED_LENGTH, SETTLED_LENGTH, SETTLED_ANGLE])
KERNEL = 0.31  # of the deviation of a place's samples, by which copies of a sample are spread


def occupied(off: FloatArray, weights: FloatArray) -> int:
    """Number of cells that samples (n, 3) of x, y, yaw about their mean fill, were all filled evenly."""
    _, cell = np.unique(np.round(off / BIN), axis=0, return_inverse=True)
    shares = np.asarray(np.bincount(cell.ravel(), weights), dtype=float)
    return round(float(np.exp(entropy(shares))))


def copies(
    off: FloatArray,
    weights: FloatArray,
    ancestors: IntArray,
    widest: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Copies (c, 3) of some of the samples (n, 3) about their mean, spread by a kernel.

    It keeps the mean and the variances of each place (Liu and West 2001), and is no wider
    than the deviations ``widest`` (3,): so places that compete stay apart, and each as narrow as it is.
    """
    chosen, own = np.unique(ancestors, return_inverse=True)
    place = places(off[chosen])
    out = np.empty((len(ancestors), 3))
    noise = rng.standard_normal(out.shape)
    for each in range(place.max() + 1):
        members, copied = chosen[place == each], place[own] == each
        share = weights[members] / weights[members].sum()
        mean = share @ off[members]
        aside = off[members] - mean
        covariance = (share[:, None] * aside).T @ aside
        alone = float(np.sum(share**2))  # one over the effective number of samples
        covariance += np.diag((alone * widest / KERNEL) ** 2)
        width = np.minimum(KERNEL, widest / np.sqrt(np.diag(covariance)))
        kept = np.sqrt(1.0 - width**2) * (off[ancestors[copied]] - mean)
        out[copied] = mean + kept + width * (noise[copied] @ square_root(covariance).T)
    if place.max() == 0:  # or the mean would wander by chance, each time that samples are copied
        out += (weights @ off) / weights.sum() - out.mean(axis=0)
    return out


def places(off: FloatArray) -> IntArray:
    """(n,) which place each sample (n, 3) belongs to: cells that touch make one place."""
    cells, cell = np.unique(np.round(off / BIN), axis=0, return_inverse=True)
    if len(cells) == 1:
        return np.zeros(len(off), dtype=np.int64)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(cells).query_pairs(1.0, p=np.inf, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=2 * (len(cells),))
    _, place = connected_components(links, directed=False)
    return np.asarray(place[cell.ravel()], dtype=np.int64)
