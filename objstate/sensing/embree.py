"""Embree, called directly: the distance along each ray to a triangle mesh."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Mesh
from objstate.errors import PlatformError
from objstate.geometry import FloatArray

if TYPE_CHECKING:
    from embreex.rtcore_scene import EmbreeScene

MISS = 1e36  # embreex reads 1e37 where a ray hits nothing


@cache
def why_no_embree() -> str | None:
    """Why embreex can't be loaded, or None where it can."""
    try:
        import embreex.mesh_construction
        import embreex.rtcore_scene  # noqa: F401
    except ImportError as error:
        return str(error)
    return None


def needs_embree(what: str) -> PlatformError:
    """The error for ``what`` can't be cast without Embree."""
    return PlatformError(
        f"{what}: this needs embreex, which can't be loaded here ({why_no_embree()}). Where "
        "there is no wheel of it, as for Linux on Arm, build it from source, or leave out lasers that "
        "aren't level (--topics). Level lasers don't need it."
    )


class EmbreeCaster:
    """Distances to one rigid mesh, in the mesh's own frame.

    Embree computes in float32. The mesh is recentred, so that a building far from the origin loses
    no digits.
    """

    def __init__(self, mesh: Mesh) -> None:
        self._scene: EmbreeScene | None = None
        self._centre = np.zeros(3)
        if len(mesh.faces) == 0:
            return
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
        vertices = np.ascontiguousarray(mesh.vertices - self._centre, dtype=np.float32)
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, vertices, np.ascontiguousarray(mesh.faces, dtype=np.int32))
        self.distances(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]))  # builds the tree once

    def distances(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Distances (n,) m along rays from ``origins`` (n, 3) in unit ``directions`` (n, 3).

        inf where nothing is hit.
        """
        if self._scene is None:
            return np.full(len(origins), np.inf)
        if origins.ndim != 2 or origins.shape[1] != 3 or origins.shape != directions.shape:
            raise ValueError(
                f"rays of shapes {origins.shape} and {directions.shape}; both must be (n, 3)"
            )
        start = np.ascontiguousarray(origins - self._centre, dtype=np.float32)
        along = np.ascontiguousarray(directions, dtype=np.float32)
        hit = np.asarray(self._scene.run(start, along, query="DISTANCE"), dtype=float)
        hit[hit > MISS] = np.inf
        return hit
