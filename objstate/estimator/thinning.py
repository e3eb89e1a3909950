"""Fewer beams of dense lasers, fewer scans of fast ones.

Neighbouring beams, and scans in quick succession, read the same surfaces with the same errors of
the model. Twice as many carry less than twice the information, although likelihoods take them as
independent.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.config import ScanSettings
from objstate.errors import LogError
from objstate.lazy import altered
from objstate.records import NANOSECONDS, Rays, Scan

ROUNDING = 1e-3  # relative difference of spacings that are meant to be equal
NEVER_NS = -(2**63)  # before all stamps


@dataclass(frozen=True, eq=False)
class _Combs:
    """A regular selection of a laser's beams, with another offset each time."""

    of: Rays
    every: int
    known: dict[int, Rays] = field(default_factory=dict)

    def taken_of(self, scan: Scan, turn: int) -> Scan:
        if self.every == 1:
            return scan
        first = turn % self.every
        if first not in self.known:
            self.known[first] = self.of.take(np.arange(first, len(scan), self.every))
        ranges = np.ascontiguousarray(scan.ranges[first :: self.every])
        return altered(scan, ranges=ranges, rays=self.known[first])


@dataclass
class _Laser:
    """The scans of one laser used so far."""

    combs: _Combs  # for its last rays, which its scans often share
    taken: int = 0
    next_ns: int = NEVER_NS  # earliest stamp of the next scan to be used


class Thinning:
    """Skips scans that follow too soon, and beams that lie too close, others each time."""

    def __init__(self, settings: ScanSettings) -> None:
        self._settings = settings
        self._lasers: dict[str, _Laser] = {}
        self.now_ns = NEVER_NS  # of the last scan

    def __call__(self, scan: Scan) -> Scan | None:
        """The part of a scan to use; None for one that is invalid or too soon after the last one.

        Raises LogError for a scan that is earlier than the last one.
        """
        if scan.stamp_ns < self.now_ns:
            raise LogError(
                f"A scan of {scan.stamp_ns} ns came after one of {self.now_ns} ns; feed records "
                "in time order, as open_log gives them."
            )
        self.now_ns = scan.stamp_ns
        if not np.count_nonzero(scan.valid):
            return None
        laser = self._lasers.get(scan.laser)
        if laser is None:
            laser = self._lasers[scan.laser] = _Laser(self._combed(scan.rays))
        if scan.stamp_ns < laser.next_ns:
            return None
        laser.next_ns = scan.stamp_ns + round(self._settings.least_gap_s * NANOSECONDS)
        laser.taken += 1
        if laser.combs.of is not scan.rays:
            laser.combs = self._combed(scan.rays)
        return laser.combs.taken_of(scan, laser.taken)

    def _combed(self, rays: Rays) -> _Combs:
        return _Combs(rays, self._every(rays))

    def _every(self, rays: Rays) -> int:
        """The number of beams of which one is used, for the spacing that the settings allow."""
        if len(rays) < 2:
            return 1
        chords = np.linalg.norm(np.diff(rays.directions, axis=0), axis=1)  # about angles, rad
        spacing = float(np.median(chords))
        may = np.radians(self._settings.beam_spacing_deg) * (1.0 + ROUNDING)
        return max(1, int(may / spacing)) if spacing > 0.0 else 1
