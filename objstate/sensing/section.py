"""Level rays at any triangle mesh without Embree, by the section in the rays' plane."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Mesh
from objstate.building.outline import outline
from objstate.geometry import FloatArray
from objstate.lazy import Later
from objstate.sensing.embree import needs_embree
from objstate.sensing.level import LEVEL, SAME_HEIGHT, flat

if TYPE_CHECKING:
    from objstate.sensing import segments
else:
    segments = Later("objstate.sensing.segments")


class SectionCaster:
    """Distances to one rigid mesh, in the mesh's own frame, along level rays.

    ``upright`` (3, 3) turns that frame into one whose z axis points up.
    """

    def __init__(self, mesh: Mesh, upright: FloatArray) -> None:
        self._upright = upright
        turned = Mesh(mesh.vertices @ upright.T, mesh.faces)
        self._section = cache(lambda step: flat(outline(turned, step * SAME_HEIGHT)))

    def distances(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Distances (n,) m along rays from ``origins`` (n, 3) in unit ``directions`` (n, 3).

        inf where nothing is hit. Raises PlatformError for rays that aren't level.
        """
        starts, along = origins @ self._upright.T, directions @ self._upright.T
        if np.abs(along[:, 2]).max(initial=0.0) > LEVEL:
            raise needs_embree("Some rays aren't level")
        out = np.full(len(starts), np.inf)
        heights, at = np.unique(np.rint(starts[:, 2] / SAME_HEIGHT), return_inverse=True)
        for number, step in enumerate(heights.tolist()):
            rays = np.flatnonzero(at == number)
            rows = np.hstack([starts[rays, :2], along[rays, :2]])
            out[rays] = segments.cast(rows, self._section(step))
        return out
