"""The believed state of every object, now, earlier and later: what planners call."""

from objstate.world.allowed import Allowed, Task, Tasks, load_tasks
from objstate.world.blocking import Blockage, Blocker
from objstate.world.door_modes import DoorMode, door_mode, door_modes
from objstate.world.due import Due
from objstate.world.floor import FloorMemory, Occupancy
from objstate.world.forgetting import Thinning
from objstate.world.route_graph import DynamicEdges, EdgeCost, RouteEdge, dynamic_edges
from objstate.world.world import Snapshot, World

__all__ = [
    "Allowed",
    "Blockage",
    "Blocker",
    "DoorMode",
    "Due",
    "DynamicEdges",
    "EdgeCost",
    "FloorMemory",
    "Occupancy",
    "RouteEdge",
    "Snapshot",
    "Task",
    "Tasks",
    "Thinning",
    "World",
    "door_mode",
    "door_modes",
    "dynamic_edges",
    "load_tasks",
]
