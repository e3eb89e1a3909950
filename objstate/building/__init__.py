"""Buildings: URDF models, occupancy maps, and what is wrong with them."""

from objstate.building.assembly import load_building
from objstate.building.from_map import building_from_map
from objstate.building.inspection import BuildingSummary, ObjectSummary, inspect_building
from objstate.building.outline import outline

__all__ = [
    "BuildingSummary",
    "ObjectSummary",
    "building_from_map",
    "inspect_building",
    "load_building",
    "outline",
]
