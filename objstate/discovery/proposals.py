"""Leaves that are tried, and what of the map is taken away where they may have been drawn."""

from __future__ import annotations

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import Cells, Doorway, background, beside
from objstate.discovery.scoring import Behind, Leaf
from objstate.geometry import FloatArray


def proposals(place: Doorway) -> list[Leaf]:
    """Leaves on either side of each opening, in some places about its jambs."""
    found = []
    for about, opening in enumerate(place.openings):
        ends = (opening.start, opening.bearing, False), (opening.end, opening.bearing + np.pi, True)
        shares = [share for share in (1.0, 0.5) if 0.55 <= share * opening.width <= 1.4]
        for start, bearing, from_end in ends:
            normal = np.array([-np.sin(bearing), np.cos(bearing)])
            for share in shares:
                for aside in np.arange(-0.2, 0.21, 0.05):
                    hinge = start + aside * normal
                    width = share * opening.width
                    for sense in (1, -1):
                        found.append(Leaf(hinge, bearing, sense, width, about, from_end, share))
    return found


def backgrounds(place: Doorway, plan: OccupancyMap) -> tuple[Behind, dict[int, list[Behind]]]:
    """The map as it is, and by opening without what it shows in the doorway, and without leaves there."""
    cells = Cells.about(plan, place.middle, place.radius + 0.3)
    as_is = Behind(*background(place, cells.segments()))
    cleared = {}
    for about, opening in enumerate(place.openings):
        between = cells.in_doorway(opening)
        variants = [between]
        for hinge, bearing in (
            (opening.start, opening.bearing),
            (opening.end, opening.bearing + np.pi),
        ):
            for turn in _drawn(cells, hinge, bearing, opening.width):
                variants.append(between | cells.on_leaf(hinge, bearing + turn, opening.width))
        cleared[about] = [Behind(*background(place, cells.segments(each))) for each in variants]
    return as_is, cleared


def _drawn(cells: Cells, hinge: FloatArray, bearing: float, width: float) -> list[float]:
    """Turns from the closed leaf at which the map shows something as long as a leaf, and no longer."""
    found: list[tuple[float, float]] = []
    size = cells.plan.resolution
    for turn in np.radians(np.arange(-175.0, 176.0, 5.0)):
        if abs(turn) < np.radians(15.0):
            continue
        along, aside = beside(cells.middles, hinge, bearing + float(turn))
        near = np.abs(aside) < 1.5 * size
        bins = np.unique(np.floor(along[near & (along > 2 * size) & (along < width)] / size))
        beyond = np.unique(
            np.floor(along[near & (along > width + 2 * size) & (along < width + 8 * size)] / size)
        )
        share = len(bins) * size / max(width - 2 * size, size)
        if share > 0.6 and len(beyond) <= 2:
            found.append((share, float(turn)))
    found.sort(reverse=True)
    kept: list[float] = []
    for _, turn in found:
        if all(abs(turn - other) > np.radians(20.0) for other in kept):
            kept.append(turn)
    return kept[:2]
