"""Buildings: URDF models, occupancy maps, and what is wrong with them."""

from objstate.building.assembly import load_building
from objstate.building.outline import outline

__all__ = ["load_building", "outline"]
