"""p(d | d-hat): how likely a beam reads d where d-hat is expected.

The paper assumes a Gaussian around the expected range (section 3); the default
adds AMCL's unexpectedly short readings, missing returns and random readings
(Thrun, Burgard and Fox 2005, section 6.3). Beams are independent given the
robot's pose and the map (eq. 10), which a tempering exponent below one corrects.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.lazy import lazy


@dataclass(frozen=True)
class BeamModel:
    """The beam likelihood of one set of settings."""

    settings: BeamModelSettings
    blur: float = 0.0  # m, in addition to the settings' sigma_hit

    def parameters(self, range_max: float) -> FloatArray:
        """(7,) the model as the kernels take it, for a laser that sees up to ``range_max`` m."""
        hit, _, missing, random = self._shares.tolist()
        sigma = self.sigma_hit
        return np.array(
            [
                hit / (sigma * math.sqrt(2.0 * math.pi)),
                1.0 / sigma,
                random / range_max,
                missing,
                hit,
                range_max,
                float(self.settings.model == "gaussian"),
            ]
        )

    def short(self, measured: FloatArray) -> FloatArray:
        """Densities (n,) of being stopped at measured ranges (n,) by something unexpected."""
        rate = self.settings.lambda_short
        stopped = np.where(np.isinf(measured), 0.0, measured)  # a missing return was not
        return np.asarray(self._shares[1] * rate * np.exp(-rate * stopped))

    @lazy
    def _shares(self) -> FloatArray:
        """(4,) of hits, short readings, missing returns and random readings; they sum to one."""
        s = self.settings
        if s.model == "gaussian":
            return np.array([1.0, 0.0, 0.0, 0.0])
        shares = np.array([s.z_hit, s.z_short, s.z_max, s.z_rand])
        return np.asarray(shares / shares.sum())

    def blurred(self, blur: float) -> BeamModel:
        """The model with ``sigma_hit`` widened by ``blur`` m, as variances add."""
        model = BeamModel(self.settings, math.hypot(self.blur, blur))
        model.__dict__["_shares"] = self._shares  # the same: the cache is filled with it
        return model

    @property
    def sigma_hit(self) -> float:
        """Standard deviation of a hit, m, blur included."""
        return math.hypot(self.settings.sigma_hit, self.blur)

    def fit(
        self, log_likelihood: float, measured: FloatArray, short: FloatArray, range_max: float
    ) -> float:
        """How well ranges (n,) with that log-likelihood are explained, where ``short`` (n,) is ``self.short`` of them.

        0 is as by chance (short and random readings alone), 1 as by hits alone with errors of
        ``sigma_hit``. Clipped to that.
        """
        from objstate.sensing import kernels

        worst, best = kernels.chances(measured, short, self.parameters(range_max))
        return float(min(max((log_likelihood - worst) / (best - worst), 0.0), 1.0))

    def __call__(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], FloatArray]:
        """Condition on measured ranges (n,): gives log p(d_i | d-hat_i) (..., n) of expected (..., n)."""
        from objstate.sensing import kernels

        parameters, short = self.parameters(range_max), self.short(measured)

        def log_likelihood(expected: FloatArray) -> FloatArray:
            rows = np.ascontiguousarray(expected, dtype=float)
            rows = rows.reshape(int(np.prod(rows.shape[:-1])), rows.shape[-1])
            out = np.empty_like(rows)
            kernels.log_likelihoods(np.ascontiguousarray(measured), short, rows, parameters, out)
            return out.reshape(expected.shape)

        return log_likelihood

    def total(self, measured: FloatArray, expected: FloatArray, range_max: float) -> FloatArray:
        """log p(o | d-hat) (p,) of all measured ranges (n,) together, for expected ranges (p, n)."""
        return np.asarray(self.totals(measured[None], expected, range_max)[0])

    def totals(self, measured: FloatArray, expected: FloatArray, range_max: float) -> FloatArray:
        """The same (m, p) of each of some scans (m, n)."""
        from objstate.sensing import kernels

        out = np.empty((len(measured), len(expected)))
        kernels.total_log_likelihoods(
            np.ascontiguousarray(measured),
            self.short(measured),
            np.ascontiguousarray(expected),
            self.parameters(range_max),
            out,
        )
        return out
