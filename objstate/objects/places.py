"""Where samples of furniture gather: places that compete, each with its own spread."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later
from objstate.objects.belief import SETTLED_ANGLE, SETTLED_LENGTH

if TYPE_CHECKING:
    from objstate.objects import sampling
else:
    sampling = Later("objstate.objects.sampling")

# Cells in which samples are counted: what is settled fills few of them.
CELL = 2.0 * np.array([SETTLED_LENGTH, SETTLED_LENGTH, SETTLED_ANGLE])


def occupied(off: FloatArray, weights: FloatArray) -> int:
    """Number of cells that samples (n, 3) of x, y, yaw about their mean fill, were all filled evenly."""
    return int(sampling.occupied(off, weights, CELL))


def copies(
    off: FloatArray,
    weights: FloatArray,
    ancestors: IntArray,
    widest: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Copies (c, 3) of some of the samples (n, 3) about their mean, by ascending ``ancestors`` (c,).

    A kernel spreads them. It keeps the mean and the variances of each place (Liu and West 2001), and
    is no wider than the deviations ``widest`` (3,): so places that compete stay apart, and each as
    narrow as it is. Cells that touch are one place.
    """
    out = np.empty((len(ancestors), 3))
    noise = rng.standard_normal(out.shape)
    sampling.copies(off, weights, ancestors, CELL, widest, noise, out)
    return out
