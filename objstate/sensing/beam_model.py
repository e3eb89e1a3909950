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
from typing import TYPE_CHECKING

import numpy as np

from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.lazy import Later, lazy

if TYPE_CHECKING:
    from objstate.sensing import kernels
else:
    kernels = Later("objstate.sensing.kernels")

LEAST_DENSITY = 1e-100  # of the pure Gaussian, which has no floor of its own (21 sigmas)


@dataclass(frozen=True)
class BeamModel:
    """The beam likelihood of one set of settings."""

    settings: BeamModelSettings
    blur: float = 0.0  # m, in addition to the settings' sigma_hit

    def parameters(self, range_max: float) -> FloatArray:
        """(9,) the model as the kernels take it, for a laser that sees up to ``range_max`` m."""
        hit, _, missing, random = self._shares
        sigma = self.sigma_hit
        peak = hit / (sigma * math.sqrt(2.0 * math.pi))
        return np.array(
            [peak, 1.0 / sigma, random / range_max, missing, hit, range_max, *self._kind]
        )

    def short(self, measured: FloatArray) -> FloatArray:
        """Densities (n,) of being stopped at measured ranges (n,) by something unexpected."""
        rate, out = self.settings.lambda_short, np.empty(len(measured))
        kernels.short(np.ascontiguousarray(measured), rate, self._shares[1] * rate, out)
        return out

    def lasting(self, measured: FloatArray) -> FloatArray:
        """Densities (n,) of being stopped by the unexpected thing that stopped the beam before.

        Its surface goes on: the range (n,) is about that of the beam before, in the scan's own order.
        """
        std, out = self.settings.short_std, np.empty(len(measured))
        peak = sum(self._shares[:2]) / (std * math.sqrt(2.0 * math.pi))
        kernels.lasting(np.ascontiguousarray(measured), std, peak, out)
        return out

    @lazy
    def beam_by_beam(self) -> BeamModel:
        """The same model, but each beam is stopped by itself."""
        return BeamModel(self.settings.model_copy(update={"short_run": 1.0}), self.blur)

    @lazy
    def _kind(self) -> tuple[float, float, float]:
        """What no blur and no laser changes of the ``parameters``: GAUSSIAN, UNEXPECTED and LASTING."""
        hit, short, _, _ = self._shares
        unexpected = short / (hit + short)  # stops a beam, of those that read some thing
        lasts = 1.0 - 1.0 / self.settings.short_run if unexpected > 0.0 else 0.0
        return float(self.settings.model == "gaussian"), unexpected, lasts

    @lazy
    def _shares(self) -> tuple[float, float, float, float]:
        """Of hits, short readings, missing returns and random readings; they sum to one."""
        s = self.settings
        if s.model == "gaussian":
            return 1.0, 0.0, 0.0, 0.0
        total = s.z_hit + s.z_short + s.z_max + s.z_rand
        return s.z_hit / total, s.z_short / total, s.z_max / total, s.z_rand / total

    def blurred(self, blur: float) -> BeamModel:
        """The model with ``sigma_hit`` widened by ``blur`` m, as variances add."""
        model = BeamModel(self.settings, math.hypot(self.blur, blur))
        model.__dict__.update(_shares=self._shares, _kind=self._kind)  # no blur changes them
        return model

    @property
    def sigma_hit(self) -> float:
        """Standard deviation of a hit, m, blur included."""
        return math.hypot(self.settings.sigma_hit, self.blur)

    def __call__(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], FloatArray]:
        """Condition on measured ranges (n,): gives log p(d_i | d-hat_i) (..., n) of expected (..., n)."""
        parameters, short = self.parameters(range_max), self.short(measured)

        def log_likelihood(expected: FloatArray) -> FloatArray:
            rows = np.ascontiguousarray(expected, dtype=float)
            rows = rows.reshape(int(np.prod(rows.shape[:-1])), rows.shape[-1])
            out = np.empty_like(rows)
            kernels.log_likelihoods(np.ascontiguousarray(measured), short, rows, parameters, out)
            return out.reshape(expected.shape)

        return log_likelihood

    def along(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
        """Condition on a scan's measured ranges (n,) in its own order, of which one thing may stop several.

        Gives log p(o | d-hat) (...,) of expected ranges (..., n), and the probability (..., n) of each
        beam, by those up to it, that it reads what was expected. The loops of ``runs``, to read.
        """
        peak, per_sigma, floor, missing, hit, _, _, unexpected, lasts = self.parameters(range_max)
        gaussian, surely = self.settings.model == "gaussian", 1.0 - unexpected
        read = np.minimum(measured, range_max) if gaussian else measured
        floor = LEAST_DENSITY if gaussian else floor
        short, lasting = self.short(measured), self.lasting(read)

        def told(expected: FloatArray) -> tuple[FloatArray, FloatArray]:
            stopped, share = np.full(expected.shape[:-1], unexpected), np.empty(expected.shape)
            log = np.zeros(expected.shape[:-1])
            for j, reading in enumerate(read):
                is_before = reading < expected[..., j]
                if np.isinf(reading):
                    hits, least = hit / surely * (expected[..., j] >= range_max), missing
                else:
                    meets = np.minimum(expected[..., j], range_max if gaussian else np.inf)
                    off, least = (reading - meets) * per_sigma, floor
                    hits = peak / surely * np.exp(-0.5 * off**2)
                reaches = lasts * (1.0 - stopped) + (1.0 - lasts) * surely
                goes_on = lasts * stopped * (least + lasting[j] * is_before)
                begins = (1.0 - lasts) * (unexpected * least + short[j] * is_before)
                density = reaches * (hits + least) + goes_on + begins
                share[..., j] = reaches * hits / density
                stopped = (goes_on + begins) / density
                log += np.log(density)
            return log, share

        return told

    def totals(self, measured: FloatArray, expected: FloatArray, range_max: float) -> FloatArray:
        """log p(o | d-hat) (m, p) of scans (m, n) of beams that are stopped each by itself.

        For expected ranges (p, n).
        """
        out = np.empty((len(measured), len(expected)))
        kernels.total_log_likelihoods(
            np.ascontiguousarray(measured),
            self.short(measured.ravel()).reshape(measured.shape),
            np.ascontiguousarray(expected),
            self.parameters(range_max),
            out,
        )
        return out
