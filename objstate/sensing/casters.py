"""Ray casting at a mesh: by Embree where it can be loaded, else by sections for level rays."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from objstate.building.model import Mesh
from objstate.geometry import FloatArray
from objstate.sensing.embree import EmbreeCaster, why_no_embree
from objstate.sensing.section import SectionCaster


class Caster(Protocol):
    """Distances to one rigid mesh, in the mesh's own frame."""

    def distances(self, origins: FloatArray, directions: FloatArray) -> FloatArray:
        """Distances (n,) m along rays from ``origins`` (n, 3) in unit ``directions`` (n, 3).

        inf where nothing is hit.
        """


def caster_of(mesh: Mesh, upright: FloatArray | None = None) -> Caster:
    """The caster of a mesh; ``upright`` (3, 3) turns its frame so that the z axis points up.

    Without Embree, rays must be level; others raise PlatformError.
    """
    if why_no_embree() is None:
        return EmbreeCaster(mesh)
    return SectionCaster(mesh, np.eye(3) if upright is None else upright)
