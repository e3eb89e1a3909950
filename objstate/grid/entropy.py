"""How unsure the cells of a map are (Darmstadt, eq. 2.20 and section 7.1)."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.grid import rasters
else:
    rasters = Later("objstate.grid.rasters")

Values = NDArray[np.float32]
Method = Literal["series", "table", "logarithms"]

TABLE_SIZE = (
    1024  # intervals; interpolation is within 1e-3 bits of the logarithms, next to 0 and 1 too
)
TERMS = 6  # of the series, which is within 1e-3 bits


def entropy(values: Values, method: Method = "series") -> Values:
    """Entropies, bits, of cells that are occupied with probabilities of any shape.

    By logarithms, by the thesis' look-up table with linear interpolation, or by a polynomial
    without a table, which processors work out for eight cells at a time. The latter two are within
    1e-3 bits.
    """
    flat = np.ascontiguousarray(values, dtype=np.float32).ravel()
    out = np.empty_like(flat)
    if method == "series":
        rasters.entropies_by_series(flat, _series(), out)
    elif method == "table":
        rasters.entropies_from_table(flat, *_table(), out)
    else:
        rasters.entropies(flat, out)
    return out.reshape(values.shape)


def _exact(p: NDArray[np.float64]) -> NDArray[np.float64]:
    inside = np.clip(p, 1e-300, 1.0 - 1e-16)
    return np.asarray(-(inside * np.log2(inside) + (1.0 - inside) * np.log2(1.0 - inside)))


@cache
def _table() -> tuple[Values, Values]:
    table = _exact(np.linspace(0.0, 1.0, TABLE_SIZE + 1))
    return table.astype(np.float32), np.append(np.diff(table), 0.0).astype(np.float32)


@cache
def _series() -> Values:
    """The polynomial in ``w = 2 sqrt(p (1 - p))`` that is nearest at Chebyshev's points."""
    w = 0.5 - 0.5 * np.cos(np.pi * (np.arange(256) + 0.5) / 256)
    powers = w[:, None] ** np.arange(1, TERMS + 1)
    exact = _exact((1.0 - np.sqrt(1.0 - w**2)) / 2.0)
    return np.linalg.lstsq(powers, exact)[0].astype(np.float32)
