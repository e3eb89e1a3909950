"""Comparison with Embree, which is exact but for beams that graze: there a neighbour decides."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Mesh
from objstate.geometry import FloatArray
from objstate.sensing.embree import EmbreeCaster

TOLERANCE = 1e-4  # m
ASIDE = 3e-5  # m between neighbouring beams: more than float32 loses in a building
SKIN = 1e-3  # m: a beam that starts so near to a face is not judged
AXES = np.concatenate([np.eye(3), -np.eye(3)])


def assert_as_embree(
    found: FloatArray, mesh: Mesh, origins: FloatArray, directions: FloatArray
) -> None:
    """Ranges (n,) lie within 0.1 mm of Embree's, or between those of parallel beams close by."""
    caster = EmbreeCaster(mesh)
    sides = [np.zeros_like(origins)]
    for across in ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]):
        aside = np.cross(directions, across)
        sides += [ASIDE * aside, -ASIDE * aside]
    exact = np.array([caster.distances(origins + side, directions) for side in sides])
    below, above = exact.min(axis=0) - TOLERANCE, exact.max(axis=0) + TOLERANCE
    around = [caster.distances(origins, np.tile(axis, (len(origins), 1))) for axis in AXES]
    judged = np.min(around, axis=0) > 2 * SKIN  # a face is no farther along some axis
    wrong = np.flatnonzero(judged & ~((found >= below) & (found <= above)))
    assert not len(wrong), [
        (int(i), float(found[i]), float(exact[0, i]), float(below[i]), float(above[i]))
        for i in wrong[:3]
    ]
