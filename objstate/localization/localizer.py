"""Monte Carlo localization: prediction by odometry, correction by scans, adaptive sample size."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, IntArray, square_root
from objstate.lazy import lazy
from objstate.localization import samples
from objstate.localization.belief import PoseBelief
from objstate.localization.motion import motion_variances, sample_motion
from objstate.localization.odometry_error import OdometryError
from objstate.particles import Weights, kld_sample_size, largest_step, systematic

LEVER = 3.0  # m; distance at which a turn of the robot is measured as a displacement


@dataclass(frozen=True)
class Localizer:
    """The two steps of Monte Carlo localization, as functions of a belief."""

    settings: LocalizationSettings

    @property
    def start_covariance(self) -> FloatArray:
        """(3, 3) of a start pose that is given without a covariance."""
        s = self.settings
        std = np.array([s.initial_xy_std, s.initial_xy_std, np.radians(s.initial_yaw_std_deg)])
        return np.diag(std**2)

    def start(
        self, mean: FloatArray, covariance: FloatArray, rng: np.random.Generator
    ) -> PoseBelief:
        """The belief given by a pose (3,) with a covariance (3, 3)."""
        return PoseBelief.gaussian(mean, covariance, self.settings.max_particles, rng)

    def predict(
        self,
        belief: PoseBelief,
        step: FloatArray,
        rng: np.random.Generator,
        error: OdometryError | None = None,
    ) -> PoseBelief:
        """p(l | a), eq. (7): the belief after the odometry moved by ``step`` (3,).

        The noise is that of the alphas, or of the learnt ``error`` of the odometry, which records
        the step.
        """
        if not any(step.tolist()):
            return belief
        variances = motion_variances(step, self.settings)
        if error is not None:
            step, variances = error.drive(step, variances)
        return PoseBelief(sample_motion(belief.poses, step, variances, rng), belief.weights)

    def blur(self, belief: PoseBelief) -> float:
        """m by which ranges are blurred: half the distance between neighbouring samples.

        It matters only while samples are sparse.
        """
        return self._spacing(belief) / 2.0

    def correct(self, belief: PoseBelief, log_likelihood: FloatArray) -> PoseBelief:
        """p(l | o), eq. (6), for a tempered log p(o | l) (n,).

        The exponent is lowered until enough samples are effective, which matters only while samples
        are sparse.
        """
        enough = self.settings.least_effective * len(belief.weights)
        weights, _ = belief.weights.reweight(log_likelihood)
        if weights.effective_size < enough:
            step = largest_step(belief.weights, log_likelihood, 1.0, enough)
            weights, _ = belief.weights.reweight(step * log_likelihood)
        return PoseBelief(belief.poses, weights)

    def renew(
        self, belief: PoseBelief, rng: np.random.Generator
    ) -> tuple[PoseBelief, IntArray | None]:
        """The belief, resampled where few samples are effective, and the ancestors (n,).

        The ancestors are None where the belief wasn't resampled.
        """
        s = self.settings
        if belief.weights.effective_size >= s.resample_below * len(belief.weights):
            return belief, None
        return self._resample(belief, s.min_particles, rng)

    def _resample(
        self, belief: PoseBelief, fewest: int, rng: np.random.Generator
    ) -> tuple[PoseBelief, IntArray]:
        """Systematic resampling to the size of KLD sampling (Fox 2003), or to the ``fewest``.

        Copies are spread by a small kernel (regularized particle filter, Musso, Oudjane and Le
        Gland 2001), so that a robot that stands still keeps a belief rather than copies of one
        sample.
        """
        s = self.settings
        ancestors = systematic(belief.weights, len(belief.weights), rng)
        needed = kld_sample_size(self._occupied(belief.poses[ancestors]), s.pf_err, s.pf_z)
        count = min(max(needed, fewest), max(s.max_particles, len(ancestors) // 2))
        if count != len(ancestors):
            ancestors = systematic(belief.weights, count, rng)
        noise, root = rng.standard_normal((count, 3)), square_root(belief.covariance)
        width = s.kernel_width * count ** (-1.0 / 7.0)  # the optimal order in 3-D
        poses = samples.copies(belief.poses, ancestors, noise, root, width, self._bin)
        return PoseBelief(poses, Weights.uniform(count)), ancestors

    @lazy
    def _bin(self) -> FloatArray:
        """(3,) sizes of the KLD grid's cells."""
        s = self.settings
        return np.array([s.bin_xy, s.bin_xy, np.radians(s.bin_yaw_deg)])

    def _occupied(self, poses: FloatArray) -> int:
        """The number of cells of the KLD grid that hold a sample.

        The first sample lies in the middle of its cell.
        """
        return len(set(samples.cells(poses, self._bin).tolist()))

    def _spacing(self, belief: PoseBelief) -> float:
        """Distance in m between neighbouring samples, with a turn measured at ``LEVER``."""
        (xx, xy, xt), (_, yy, yt), (_, _, tt) = belief.covariance.tolist()
        determinant = xx * (yy * tt - yt * yt) - xy * (xy * tt - yt * xt) + xt * (xy * yt - yy * xt)
        volume = 4.0 / 3.0 * math.pi * LEVER * math.sqrt(max(determinant, 0.0))
        cell = LEVER * math.prod(self._bin.tolist())
        if volume > cell:  # several clusters may lie far apart, with nothing between
            volume = min(volume, cell * self._occupied(belief.poses))
        return math.cbrt(volume / len(belief.weights))
