"""p(d | d-hat): the likelihood of a range d where d-hat is expected.

The paper assumes a Gaussian about the expected range (section 3). The default adds AMCL's short
readings, missing returns and random readings (Thrun, Burgard and Fox 2005, section 6.3). Beams are
independent given the robot's pose and the map (eq. 10), which a tempering exponent below one
corrects.
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
    from objstate.sensing import sweeps
else:
    sweeps = Later("objstate.sensing.sweeps")

LEAST_DENSITY = 1e-100  # of the pure Gaussian, which has no density of random readings (21 sigmas)


@dataclass(frozen=True)
class BeamModel:
    """The beam likelihood for one set of settings."""

    settings: BeamModelSettings
    blur: float = 0.0  # m, in addition to the settings' sigma_hit
    # mean number of neighbouring beams that one unexpected thing stops; 1: beams are independent
    run: float = BeamModelSettings.short_run

    def parameters(self, range_max: float) -> FloatArray:
        """(9,) the parameters of the kernels, for a laser with a range of up to ``range_max`` m."""
        hit, _, missing, random = self._shares
        sigma = self.sigma_hit
        peak = hit / (sigma * math.sqrt(2.0 * math.pi))
        return np.array(
            [peak, 1.0 / sigma, random / range_max, missing, hit, range_max, *self._kind]
        )

    def short(self, measured: FloatArray) -> FloatArray:
        """Densities (n,) of measured ranges (n,) for beams that something unexpected stops."""
        rate, out = self.settings.lambda_short, np.empty(len(measured))
        sweeps.short(np.ascontiguousarray(measured), rate, self._shares[1] * rate, out)
        return out

    def lasting(self, measured: FloatArray) -> FloatArray:
        """Densities (n,) for beams stopped by the same unexpected thing as the beam before.

        Its surface continues: the range (n,) is about that of the previous beam in the scan's
        order.
        """
        std, out = self.settings.short_std, np.empty(len(measured))
        peak = sum(self._shares[:2]) / (std * math.sqrt(2.0 * math.pi))
        sweeps.lasting(np.ascontiguousarray(measured), std, peak, out)
        return out

    @lazy
    def beam_by_beam(self) -> BeamModel:
        """The same model with independent beams."""
        return BeamModel(self.settings, self.blur, run=1.0)

    @lazy
    def _kind(self) -> tuple[float, float, float]:
        """The ``parameters`` GAUSSIAN, UNEXPECTED and LASTING, which depend on no blur."""
        hit, short, _, _ = self._shares
        unexpected = short / (hit + short)  # of the beams that read a surface
        lasts = 1.0 - 1.0 / self.run if unexpected > 0.0 else 0.0
        return float(self.settings.model == "gaussian"), unexpected, lasts

    @lazy
    def _shares(self) -> tuple[float, float, float, float]:
        """Shares of hits, short readings, missing returns and random readings; they sum to one."""
        s = self.settings
        if s.model == "gaussian":
            return 1.0, 0.0, 0.0, 0.0
        total = s.z_hit + s.z_short + s.z_max + s.z_rand
        return s.z_hit / total, s.z_short / total, s.z_max / total, s.z_rand / total

    def blurred(self, blur: float) -> BeamModel:
        """The model with ``blur`` m added to ``sigma_hit``, as variances add."""
        model = BeamModel(self.settings, math.hypot(self.blur, blur), self.run)
        # these don't depend on the blur
        model.__dict__.update(_shares=self._shares, _kind=self._kind)
        return model

    @property
    def sigma_hit(self) -> float:
        """Standard deviation of a hit, m, blur included."""
        return math.hypot(self.settings.sigma_hit, self.blur)

    def __call__(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], FloatArray]:
        """A function of expected ranges (..., n) that gives log p(d_i | d-hat_i) (..., n).

        It is conditioned on the measured ranges (n,).
        """
        parameters, short = self.parameters(range_max), self.short(measured)

        def log_likelihood(expected: FloatArray) -> FloatArray:
            rows = np.ascontiguousarray(expected, dtype=float)
            rows = rows.reshape(int(np.prod(rows.shape[:-1])), rows.shape[-1])
            out = np.empty_like(rows)
            sweeps.log_likelihoods(np.ascontiguousarray(measured), short, rows, parameters, out)
            return out.reshape(expected.shape)

        return log_likelihood

    def along(
        self, measured: FloatArray, range_max: float
    ) -> Callable[[FloatArray], tuple[FloatArray, FloatArray]]:
        """A function of expected ranges (..., n), where one thing may stop several beams.

        It gives log p(o | d-hat) (...,), and the probability (..., n) that each beam reads what is
        expected, given the beams up to it. It is conditioned on measured ranges (n,) in the scan's
        order. A readable form of the loops of ``runs``.
        """
        peak, per_sigma, floor, missing, hit, _, _, unexpected, lasts = self.parameters(range_max)
        gaussian, surely = self.settings.model == "gaussian", 1.0 - unexpected
        read = np.minimum(measured, range_max) if gaussian else measured
        floor = LEAST_DENSITY if gaussian else floor
        short, lasting = self.short(measured), self.lasting(read)

        def densities(expected: FloatArray) -> tuple[FloatArray, FloatArray]:
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

        return densities

    def totals(self, measured: FloatArray, expected: FloatArray, range_max: float) -> FloatArray:
        """log p(o | d-hat) (m, p) of scans (m, n) of independent beams.

        For expected ranges (p, n).
        """
        out = np.empty((len(measured), len(expected)))
        sweeps.total_log_likelihoods(
            np.ascontiguousarray(measured),
            self.short(measured.ravel()).reshape(measured.shape),
            np.ascontiguousarray(expected),
            self.parameters(range_max),
            out,
        )
        return out
