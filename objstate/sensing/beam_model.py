"""p(d | d-hat): how likely a beam reads d where d-hat is expected.

The paper assumes a Gaussian around the expected range (section 3); the default
adds AMCL's unexpectedly short readings, missing returns and random readings
(Thrun, Burgard and Fox 2005, section 6.3). Beams are independent given the
robot's pose and the map (eq. 10), which a tempering exponent below one corrects.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray


@dataclass(frozen=True)
class BeamModel:
    """The beam likelihood of one set of settings."""

    settings: BeamModelSettings

    def parameters(self, range_max: float) -> FloatArray:
        """(8,) the model as the kernels take it, for a laser that sees up to ``range_max`` m."""
        s = self.settings
        shares = np.array([s.z_hit, s.z_short, s.z_max, s.z_rand])
        gaussian = float(s.model == "gaussian")
        tail = [s.sigma_hit, s.lambda_short, range_max, gaussian]
        return np.concatenate([shares / shares.sum(), tail])

    def blurred(self, blur: float) -> BeamModel:
        """The model with ``sigma_hit`` widened by ``blur`` m, as variances add."""
        sigma = float(np.hypot(self.settings.sigma_hit, blur))
        return BeamModel(self.settings.model_copy(update={"sigma_hit": sigma}))

    def __call__(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], FloatArray]:
        """Condition on measured ranges (n,): gives log p(d_i | d-hat_i) (..., n) of expected (..., n)."""
        from objstate.sensing import kernels

        parameters = self.parameters(range_max)

        def log_likelihood(expected: FloatArray) -> FloatArray:
            rows = np.ascontiguousarray(expected, dtype=float).reshape(-1, len(measured))
            out = np.empty_like(rows)
            kernels.log_likelihoods(np.ascontiguousarray(measured), rows, parameters, out)
            return out.reshape(expected.shape)

        return log_likelihood
