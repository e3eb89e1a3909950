"""Monte Carlo localization: prediction by odometry, correction by scans, adaptive sample size."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, IntArray, square_root
from objstate.lazy import lazy
from objstate.localization import kernels
from objstate.localization.belief import PoseBelief
from objstate.localization.motion import motion_variances, sample_motion
from objstate.localization.odometry_error import OdometryError
from objstate.particles import Weights, kld_sample_size, largest_step, systematic

LEVER = 3.0  # m; a turn of the robot moves what it sees at this distance


@dataclass(frozen=True)
class Localizer:
    """The two steps of Monte Carlo localization, as functions of a belief."""

    settings: LocalizationSettings

    @property
    def told_covariance(self) -> FloatArray:
        """(3, 3) of a start pose that comes without one."""
        s = self.settings
        std = np.array([s.initial_xy_std, s.initial_xy_std, np.radians(s.initial_yaw_std_deg)])
        return np.diag(std**2)

    def start(
        self, mean: FloatArray, covariance: FloatArray, rng: np.random.Generator
    ) -> PoseBelief:
        """The belief of somebody who was told a pose (3,) with a covariance (3, 3)."""
        return PoseBelief.gaussian(mean, covariance, self.settings.max_particles, rng)

    def predict(
        self,
        belief: PoseBelief,
        step: FloatArray,
        rng: np.random.Generator,
        error: OdometryError | None = None,
    ) -> PoseBelief:
        """p(l | a), eq. (7): the belief after the odometry moved by ``step`` (3,).

        The noise is what the alphas say, or what was learnt of the odometry's ``error``, which hears of the step.
        """
        if not any(step.tolist()):
            return belief
        variances = motion_variances(step, self.settings)
        if error is not None:
            step, variances = error.drive(step, variances)
        return PoseBelief(sample_motion(belief.poses, step, variances, rng), belief.weights)

    def blur(self, belief: PoseBelief) -> float:
        """m by which ranges are blurred: each sample stands for half the way to its neighbours.

        It matters only while samples are sparse.
        """
        return self._spacing(belief) / 2.0

    def correct(self, belief: PoseBelief, log_likelihood: FloatArray) -> PoseBelief:
        """p(l | o), eq. (6), for a tempered log p(o | l) (n,).

        No more of it is taken than leaves enough samples effective, which matters only
        while samples are sparse.
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
        """The belief resampled where few samples carry it, and which samples (n,) were taken.

        None where it was left as it is.
        """
        s = self.settings
        if belief.weights.effective_size >= s.resample_below * len(belief.weights):
            return belief, None
        return self._resample(belief, s.min_particles, rng)

    def _resample(
        self, belief: PoseBelief, fewest: int, rng: np.random.Generator
    ) -> tuple[PoseBelief, IntArray]:
        """Systematic resampling to the size that KLD sampling asks for (Fox 2003), or the ``fewest``.

        Copies are spread by a small kernel (regularized particle filter, Musso,
        Oudjane and Le Gland 2001), so that a robot that stands still keeps a
        belief rather than copies of one sample.
        """
        s = self.settings
        ancestors = systematic(belief.weights, len(belief.weights), rng)
        needed = kld_sample_size(self._occupied(belief.poses[ancestors]), s.pf_err, s.pf_z)
        count = min(max(needed, fewest), max(s.max_particles, len(ancestors) // 2))
        if count != len(ancestors):
            ancestors = systematic(belief.weights, count, rng)
        noise, root = rng.standard_normal((count, 3)), square_root(belief.covariance)
        width = s.kernel_width * count ** (-1.0 / 7.0)  # the optimal order in 3-D
        poses = kernels.copies(belief.poses, ancestors, noise, root, width, self._bin)
        return PoseBelief(poses, Weights.uniform(count)), ancestors

    @lazy
    def _bin(self) -> FloatArray:
        """(3,) sizes of the KLD grid's cells."""
        s = self.settings
        return np.array([s.bin_xy, s.bin_xy, np.radians(s.bin_yaw_deg)])

    def _occupied(self, poses: FloatArray) -> int:
        """How many cells of the KLD grid, the first of which has its middle in theirs, hold a sample."""
        return len(set(kernels.cells(poses, self._bin).tolist()))

    def _spacing(self, belief: PoseBelief) -> float:
        """Distance in m between neighbouring samples, a turn counted at ``LEVER``."""
        (xx, xy, xt), (_, yy, yt), (_, _, tt) = belief.covariance.tolist()
        determinant = xx * (yy * tt - yt * yt) - xy * (xy * tt - yt * xt) + xt * (xy * yt - yy * xt)
        volume = 4.0 / 3.0 * math.pi * LEVER * math.sqrt(max(determinant, 0.0))
        cell = LEVER * math.prod(self._bin.tolist())
        if volume > cell:  # several clouds may stand far apart, with nothing between
            volume = min(volume, cell * self._occupied(belief.poses))
        return math.cbrt(volume / len(belief.weights))
