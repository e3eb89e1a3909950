"""Where samples of furniture gather: places that compete, each with its own spread."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray, IntArray, square_root
from objstate.objects.belief import SETTLED_ANGLE, SETTLED_LENGTH
from objstate.particles import entropy

# Cells in which samples are counted: what is settled fills few of them.
BIN = 2.0 * np.array([SETTLED_LENGTH, SETTLED_LENGTH, SETTLED_ANGLE])
CELLS = 1 << 20  # along each axis, that are told apart
AXES = np.array([CELLS * CELLS, CELLS, 1])
TOUCHING = (np.indices((3, 3, 3)).reshape(3, -1).T - 1) @ AXES  # from a cell to those that touch it
KERNEL = 0.31  # of the deviation of a place's samples, by which copies of a sample are spread


def occupied(off: FloatArray, weights: FloatArray) -> int:
    """Number of cells that samples (n, 3) of x, y, yaw about their mean fill, were all filled evenly."""
    _, cell = np.unique(_cells(off), return_inverse=True)
    shares = np.asarray(np.bincount(cell, weights), dtype=float)
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
    cells, cell = np.unique(_cells(off), return_inverse=True)
    place, left = np.zeros(len(cells), dtype=np.int64), {c: k for k, c in enumerate(cells.tolist())}
    number = 0
    while left:
        reached = [left.popitem()]
        for middle, k in reached:
            place[k] = number
            touching = [c for c in (middle + TOUCHING).tolist() if c in left]
            reached += [(c, left.pop(c)) for c in touching]
        number += 1
    return place[cell]


def _cells(off: FloatArray) -> IntArray:
    """(n,) the number of the cell in which each sample (n, 3) lies."""
    return np.asarray(np.round(off / BIN).astype(np.int64) @ AXES)
