"""Buildings of other tools: read from their files, and written as such."""

from objstate.interchange.importing import import_building

__all__ = ["import_building"]
