"""A few thinned scans of a run, to be drawn over the walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.estimator import Estimator
from objstate.geometry import FloatArray, IntArray
from objstate.recording.scans import ScanWriter, ThinScan
from objstate.records import Estimate, Record, Scan

STEP_NS = 1_000_000_000  # least time between two scans of one laser
SPACING = 0.08  # m between neighbouring ends; closer ones look like a line on a plan
MOST_ENDS = 80  # of one scan; about 0.4 kB of a file


class ScanRecorder:
    """Writes ends of beams, at most once a second for each laser."""

    def __init__(self, writer: ScanWriter) -> None:
        self._writer = writer
        self._written_ns: dict[str, int] = {}

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Write a scan whose laser's last one is old enough."""
        if not isinstance(record, Scan) or not self._is_due(record):
            return
        self._written_ns[record.laser] = record.stamp_ns
        ends = ends_of(record)
        self._writer.write([ThinScan(record.stamp_ns, record.laser, ends[thinned(ends)])])

    def _is_due(self, scan: Scan) -> bool:
        last = self._written_ns.get(scan.laser)
        return last is None or scan.stamp_ns - last >= STEP_NS


def ends_of(scan: Scan) -> FloatArray:
    """(n, 2) m in base_link, the ends of beams that returned, in the order of the beams."""
    returned = np.isfinite(scan.ranges)
    rays = scan.rays.take(returned)
    return np.asarray(
        rays.origins[:, :2] + scan.ranges[returned, None] * rays.directions[:, :2], dtype=float
    )


def thinned(ends: FloatArray) -> IntArray:
    """The indices (k,) of ends (n, 2) to keep: ``SPACING`` apart, at most ``MOST_ENDS``."""
    way = np.hypot(*np.diff(ends, axis=0).T).cumsum()
    paces = np.concatenate([np.zeros(min(1, len(ends))), way]) // SPACING
    kept = np.flatnonzero(np.diff(paces, prepend=-1.0))
    if len(kept) <= MOST_ENDS:
        return kept
    return kept[np.linspace(0, len(kept) - 1, MOST_ENDS).round().astype(np.int64)]
