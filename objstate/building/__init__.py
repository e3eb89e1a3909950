"""Buildings: URDF models, occupancy maps, and what is wrong with them."""

from objstate.building.assembly import load_building
from objstate.building.from_map import building_from_map
from objstate.building.outline import outline

__all__ = ["building_from_map", "load_building", "outline"]
