"""Sparse normal equations from blocks of readings that depend on a few unknowns each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, IntArray


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
    """Blocks and a prior in one quadratic form, factored once."""

    def __init__(self, blocks: Sequence[Blocks], precision: FloatArray, values: FloatArray) -> None:
        """``values`` (n,) are the unknowns now, whose prior is zero with ``precision`` (n,)."""
        from scipy.sparse import coo_array, diags_array
        from scipy.sparse.linalg import splu

        count = len(precision)
        self._gradient = precision * values
        hessian = diags_array(precision).tocsc()
        for each in blocks:
            np.add.at(self._gradient, each.columns.ravel(), each.slopes.ravel())
            width = each.columns.shape[1]
            rows = np.repeat(each.columns, width, axis=1).ravel()
            columns = np.tile(each.columns, (1, width)).ravel()
            entries = each.curvatures.ravel()
            hessian = hessian + coo_array((entries, (rows, columns)), shape=(count, count)).tocsc()
        self._factor = splu(hessian.tocsc())
        self._count = count

    def step(self) -> FloatArray:
        """(n,) the step of all unknowns to the least value."""
        return np.asarray(-self._factor.solve(self._gradient))

    def covariance(self, unknowns: IntArray) -> FloatArray:
        """(k, k) of some unknowns (k,)."""
        picked = np.zeros((self._count, len(unknowns)))
        picked[unknowns, np.arange(len(unknowns))] = 1.0
        return np.asarray(self._factor.solve(picked)[unknowns])
