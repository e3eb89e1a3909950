"""Whether a drive is of the building over which its scans are shown."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from objstate.building.digest import geometry_digest
from objstate.building.inspection import DEFAULT_HEIGHT
from objstate.building.model import Building
from objstate.building.outline import outline
from objstate.geometry import FloatArray

# m from walls and objects that readings off them lie, as far as poses that place them are unsure
NEAR = 0.15
# Share of a drive's readings. Of three drives in the maps of their own buildings 0.78 to 1.0 are
# near; of three in those of others 0.29 to 0.46.
MOST = 0.5
COMPARED = 10_000  # readings of a drive


def off_walls(points: FloatArray, building: Building) -> str | None:
    """A warning where most readings (n, 2) m of a drive lie off all walls and objects."""
    share = _share_near(points, building)
    if share >= MOST:
        return None
    return (
        f"only {100 * share:.0f} % of the readings lie near walls or objects of the building. Is "
        "the drive of this building, and its start right?"
    )


def of_another_building(folder: Path, summary: Mapping[str, Any], building: Building) -> str | None:
    """A warning where a result, by its ``run.json``, was estimated in another building.

    The same file with other content is no other building: it was edited since.
    """
    described = summary.get("inputs", {}).get("building", {})
    digest, path = described.get("geometry_sha256"), described.get("path")
    if digest is None or digest == geometry_digest(building):
        return None
    places = [Path(path), folder / described.get("from_result", path)]
    source = building.source
    if source is not None and source.resolve() in [place.resolve() for place in places]:
        return None
    return f"estimated in another building, {path}. Does that have the same frame?"


def _share_near(points: FloatArray, building: Building) -> float:
    """The share of points (n, 2) m near what a laser sees of a building, 1 without points."""
    import shapely

    shapes = [outline(building.walls, DEFAULT_HEIGHT)] + [
        outline(item.mesh, DEFAULT_HEIGHT, item.transforms(item.home[None])[0])
        for item in building.objects.values()
    ]
    compared = points[:: max(1, len(points) // COMPARED)]
    if not len(compared):
        return 1.0
    lines = shapely.STRtree(shapely.linestrings(np.concatenate(shapes)))
    near = lines.query(shapely.points(compared), predicate="dwithin", distance=NEAR)[0]
    return len(np.unique(near)) / len(compared)
