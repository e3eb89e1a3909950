"""Sparse normal equations from blocks of readings that depend on a few unknowns each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import lazy

if TYPE_CHECKING:
    from scipy.sparse import sparray
    from scipy.sparse.linalg import SuperLU


@dataclass(frozen=True, eq=False)
class Blocks:
    """Linearized readings: of each block, the quadratic form of its r errors over c unknowns."""

    columns: IntArray  # (n, c) which unknowns
    jacobian: FloatArray  # (n, r, c) of the readings over them
    information: FloatArray  # (n, r, r) of the readings
    pull: FloatArray  # (n, r) information times error

    @property
    def slopes(self) -> FloatArray:
        """(n, c) the gradient of each block over its unknowns."""
        return np.asarray(np.einsum("nrc,nr->nc", self.jacobian, self.pull))

    @property
    def curvatures(self) -> FloatArray:
        """(n, c, c) the Hessian of each block over its unknowns."""
        return np.asarray(self.jacobian.transpose(0, 2, 1) @ self.information @ self.jacobian)


class NormalEquations:
    """Blocks and a prior in one quadratic form, factored where needed."""

    def __init__(self, blocks: Sequence[Blocks], precision: sparray, values: FloatArray) -> None:
        """``values`` (n,) are the unknowns now, whose prior is zero with ``precision`` (n, n)."""
        from scipy.sparse import coo_array

        count = len(values)
        self._gradient = np.asarray(precision @ values)
        hessian = precision.tocsc()
        for each in blocks:
            np.add.at(self._gradient, each.columns.ravel(), each.slopes.ravel())
            width = each.columns.shape[1]
            rows = np.repeat(each.columns, width, axis=1).ravel()
            columns = np.tile(each.columns, (1, width)).ravel()
            entries = each.curvatures.ravel()
            hessian = hessian + coo_array((entries, (rows, columns)), shape=(count, count)).tocsc()
        self._hessian = hessian.tocsc()

    @lazy
    def _factor(self) -> SuperLU:
        from scipy.sparse.linalg import splu

        return splu(self._hessian)

    def step(self) -> FloatArray:
        """(n,) the step of all unknowns to the least value."""
        return np.asarray(-self._factor.solve(self._gradient))

    def covariance(self, unknowns: IntArray) -> FloatArray:
        """(k, k) of some unknowns (k,)."""
        picked = np.zeros((len(self._gradient), len(unknowns)))
        picked[unknowns, np.arange(len(unknowns))] = 1.0
        return np.asarray(self._factor.solve(picked)[unknowns])

    def marginal(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Hessian (k, k) and gradient (k,) of all but the first ``count``, at the best of these."""
        from scipy.sparse.linalg import splu

        own, across = splu(self._hessian[:count, :count].tocsc()), self._hessian[:count, count:]
        solved = own.solve(across.toarray())
        hessian = self._hessian[count:, count:].toarray() - across.T @ solved
        gradient = self._gradient[count:] - solved.T @ self._gradient[:count]
        return np.asarray(0.5 * (hessian + hessian.T)), np.asarray(gradient)
