"""Buildings of other tools: read from their files, and written as such."""

from objstate.interchange.importing import ImportOptions, ImportResult, import_building

__all__ = ["ImportOptions", "ImportResult", "import_building"]
