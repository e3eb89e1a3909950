"""The believed state of every object, now, earlier and later: what planners call."""

from objstate.world.world import Snapshot, World

__all__ = ["Snapshot", "World"]
