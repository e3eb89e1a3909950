"""A run as a scene in three dimensions, for Foxglove and RViz."""

from objstate.run.scene.recorder import SCENE, record_scene

__all__ = ["SCENE", "record_scene"]
