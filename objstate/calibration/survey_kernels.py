"""Compiled sums over the readings of a survey."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, njit
from objstate.geometry import FloatArray, IntArray


@called_with("f2 f1 f1 i1 i2 i1 i f3 f2 f3 f2")
@njit(nogil=True, error_model="numpy")
def sums(
    over: FloatArray,
    off: FloatArray,
    weights: FloatArray,
    scan: IntArray,
    others: IntArray,
    face: IntArray,
    width: int,
    of_scans: FloatArray,
    scan_slopes: FloatArray,
    of_faces: FloatArray,
    face_slopes: FloatArray,
) -> Any:
    """Sum the quadratic forms of readings: over poses, over all else, and across.

    Readings have the errors ``off`` (m,) and ``weights`` (m,). Their gradients ``over`` (m, 3 + k)
    are over the pose of their ``scan`` (m,), ascending, and over ``others`` (m, k) of ``width``
    unknowns, which are the same for all readings of a ``face`` (m,). Added to are ``of_scans``
    (n, 3, 3) and ``scan_slopes`` (n, 3), ``of_faces`` (f, k, k) and ``face_slopes`` (f, k). Returned
    are, across, the scans (t,), the other unknowns (t,) and the entries (t, 3).
    """
    poses, size, count = of_scans.shape[1], others.shape[1], 0
    place = np.full(width, -1)  # of an unknown among the entries of the scan
    latest = np.full(width, -1)  # scan that depends on it
    for j in range(over.shape[0]):
        for k in range(size):
            if latest[others[j, k]] != scan[j]:
                latest[others[j, k]] = scan[j]
                count += 1
    latest[:] = -1
    scans, unknowns = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    entries, count = np.zeros((count, poses)), 0
    for j in range(over.shape[0]):
        s, f = scan[j], face[j]
        for k in range(size):
            unknown, weighted = others[j, k], weights[j] * over[j, poses + k]
            if latest[unknown] != s:
                latest[unknown], place[unknown] = s, count
                scans[count], unknowns[count] = s, unknown
                count += 1
            face_slopes[f, k] += weighted * off[j]
            for i in range(size):
                of_faces[f, k, i] += weighted * over[j, poses + i]
            for i in range(poses):
                entries[place[unknown], i] += weighted * over[j, i]
        for k in range(poses):
            weighted = weights[j] * over[j, k]
            scan_slopes[s, k] += weighted * off[j]
            for i in range(poses):
                of_scans[s, k, i] += weighted * over[j, i]
    return scans, unknowns, entries
