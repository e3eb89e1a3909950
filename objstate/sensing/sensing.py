"""The view of a scan: by outlines where they are valid, else by triangles."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.errors import PlatformError
from objstate.geometry import BoolArray, FloatArray
from objstate.records import Rays, Scan
from objstate.sensing.beam_model import BeamModel
from objstate.sensing.embree import needs_embree, why_no_embree
from objstate.sensing.expected import ExpectedRanges
from objstate.sensing.level import Sweep, UncertainObject
from objstate.sensing.mesh_view import MeshView
from objstate.sensing.surfaces import Surfaces
from objstate.sensing.view import ScanView

if TYPE_CHECKING:
    from objstate.sensing.sweeps import Scenery


class Sensing:
    """Makes views of scans: outlines for level lasers, Embree for all others."""

    def __init__(self, building: Building, beam_model: BeamModel) -> None:
        # compiled loops are imported only where they are needed
        from objstate.sensing.level_view import LevelView
        from objstate.sensing.outlines import LevelOutlines

        self._outlines = LevelOutlines(building)
        self._expected = ExpectedRanges(building)
        self._beam_model = beam_model
        self._level_view = LevelView.of
        self._surfaces: dict[float, Surfaces] = {}
        self._sweeps: WeakKeyDictionary[Rays, Sweep | None] = WeakKeyDictionary()

    def view(self, scan: Scan, beams: BoolArray | None = None) -> ScanView:
        """The view of a scan's valid beams, or of those that ``beams`` (n,) selects."""
        chosen = scan.valid if beams is None else scan.valid & beams
        sweep = self._sweep(scan.rays)
        if sweep is None and len(scan) and why_no_embree() is not None:
            raise self._needs_embree(scan)
        if sweep is None or not np.count_nonzero(chosen):
            rays, measured = scan.rays.take(chosen), scan.ranges[chosen]
            return MeshView(self._expected, rays, measured, self._beam_model, scan.range_max)
        return self._level_view(self._outlines, sweep, scan, chosen, self._beam_model)

    @property
    def building(self) -> Building:
        """The building with which scans are compared."""
        return self._expected.building

    def is_level(self, scan: Scan) -> bool:
        """Whether outlines are valid for a scan: level laser, objects that move in the plane."""
        return self._sweep(scan.rays) is not None

    def surfaces(self, height: float) -> Surfaces:
        """The walls in a laser's plane at a height, m, as pieces with offsets."""
        if height not in self._surfaces:
            self._surfaces[height] = Surfaces(self.walls_at(height))
        return self._surfaces[height]

    def outline(self, name: str, height: float) -> FloatArray:
        """The segments (k, 4) m of an object at a height, about its origin in its home state."""
        return self._outlines.of_object(name, height).segments

    def scenery(self, objects: Sequence[UncertainObject], height: float) -> Scenery:
        """Objects in a laser's plane at a height, m, in each of their states."""
        return self._outlines.scenery(tuple(objects), height)

    def walls_at(self, height: float) -> FloatArray:
        """The segments (k, 4) in which a plane at a height, m, cuts the walls."""
        return self._outlines.walls_at(height)

    def with_object(self, item: MovableObject) -> Sensing:
        """The same building with one object, by its name, at another place."""
        other = copy(self)
        other._outlines = self._outlines.with_object(item)
        other._expected = self._expected.with_object(item)
        return other

    def _needs_embree(self, scan: Scan) -> PlatformError:
        """The error for a scan for which outlines aren't valid."""
        if self._outlines.hold:
            return needs_embree(f"The beams of laser '{scan.laser}' aren't level")
        return needs_embree(f"Some object of '{self._expected.building.name}' moves up or down")

    def _sweep(self, rays: Rays) -> Sweep | None:
        """The level sweep of some rays, or None; the scans of a laser often share their rays."""
        try:
            return self._sweeps[rays]
        except KeyError:
            sweep = self._sweeps[rays] = Sweep.of(rays) if self._outlines.hold else None
            return sweep
