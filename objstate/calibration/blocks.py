"""Sparse normal equations from blocks of readings that depend on a few unknowns each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import lazy

if TYPE_CHECKING:
    from scipy.sparse import csc_array, sparray
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


def of_forms(
    columns: IntArray, slopes: FloatArray, curvatures: FloatArray, count: int
) -> tuple[csc_array, FloatArray]:
    """Hessian (u, u) and gradient (u,) of ``count`` unknowns, by quadratic forms.

    Each has ``slopes`` (n, c) and ``curvatures`` (n, c, c) over ``columns`` (n, c) of the unknowns.
    """
    from scipy.sparse import coo_array

    width = columns.shape[1]
    places = np.repeat(columns, width, axis=1).ravel(), np.tile(columns, (1, width)).ravel()
    gradient = np.asarray(np.bincount(columns.ravel(), slopes.ravel(), count), dtype=float)
    return coo_array((curvatures.ravel(), places), shape=(count, count)).tocsc(), gradient


class NormalEquations:
    """A quadratic form, factored where needed."""

    def __init__(self, hessian: csc_array, gradient: FloatArray) -> None:
        """With a Hessian (n, n), and the gradient (n,) at the unknowns as they are now."""
        self._hessian, self._gradient = hessian, gradient

    @staticmethod
    def of(blocks: Sequence[Blocks], precision: sparray, values: FloatArray) -> NormalEquations:
        """Of blocks and a prior: of zero, with ``precision`` (n, n); ``values`` (n,) are now."""
        hessian, gradient = precision.tocsc(), np.asarray(precision @ values)
        for each in blocks:
            own, slope = of_forms(each.columns, each.slopes, each.curvatures, len(values))
            hessian, gradient = hessian + own, gradient + slope
        return NormalEquations(hessian.tocsc(), gradient)

    @lazy
    def _factor(self) -> SuperLU:
        from scipy.sparse.linalg import splu

        # it is positive definite: unknowns may be eliminated in the order that keeps it sparse
        order = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}
        return splu(self._hessian, **order, options={"SymmetricMode": True})

    def step(self) -> FloatArray:
        """(n,) the step of all unknowns to the least value."""
        return np.asarray(-self._factor.solve(self._gradient))

    def covariance(self, unknowns: IntArray) -> FloatArray:
        """(k, k) of some unknowns (k,)."""
        picked = np.zeros((len(self._gradient), len(unknowns)))
        picked[unknowns, np.arange(len(unknowns))] = 1.0
        return np.asarray(self._factor.solve(picked)[unknowns])

    def holding(self, others: IntArray) -> NormalEquations:
        """The same of all unknowns but some ``others`` (k,), which stay as they are."""
        left = np.setdiff1d(np.arange(len(self._gradient)), others)
        return NormalEquations(self._hessian[left][:, left], self._gradient[left])

    @property
    def unread(self) -> IntArray:
        """(k,) unknowns on which nothing depends."""
        return np.flatnonzero(self._hessian.diagonal() == 0.0)

    def marginal(self, chain: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Hessian (k, k) and gradient (k,) of all but the first ``count``, at the best of these.

        The first ``chain`` of them are coupled to few neighbours each, as poses along a way are.
        """
        hessian, gradient = _reduced(self._hessian, self._gradient, chain)
        return _reduced_densely(hessian, gradient, count - chain)


def _reduced(hessian: csc_array, gradient: FloatArray, chain: int) -> tuple[FloatArray, FloatArray]:
    """All but the first ``chain`` unknowns, whose own Hessian is banded (Schur complement)."""
    from scipy.linalg import cho_solve_banded, cholesky_banded

    own = hessian[:chain, :chain].tocoo()
    width = int((own.row - own.col).max(initial=0))
    band, below = np.zeros((width + 1, chain)), own.row >= own.col
    band[(own.row - own.col)[below], own.col[below]] = own.data[below]
    factor = cholesky_banded(band, lower=True)
    across = hessian[:chain, chain:]
    met = np.flatnonzero(np.diff(across.indptr))  # of the others, those that the chain depends on
    sides = np.column_stack([across[:, met].toarray(), gradient[:chain]])
    solved = cho_solve_banded((factor, True), sides)
    rest, slope = hessian[chain:, chain:].toarray(), gradient[chain:].copy()
    rest[np.ix_(met, met)] -= across[:, met].T @ solved[:, :-1]
    slope[met] -= across[:, met].T @ solved[:, -1]
    return rest, slope


def _reduced_densely(
    hessian: FloatArray, gradient: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """All but the first ``count`` unknowns of few."""
    across = hessian[:count, count:]
    sides = np.column_stack([across, gradient[:count]])
    solved = np.linalg.solve(hessian[:count, :count], sides)
    rest = hessian[count:, count:] - across.T @ solved[:, :-1]
    return np.asarray(0.5 * (rest + rest.T)), np.asarray(
        gradient[count:] - across.T @ solved[:, -1]
    )
