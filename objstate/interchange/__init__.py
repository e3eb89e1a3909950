"""Buildings of other tools: read from their files, and written as such."""

from objstate.interchange.exporting import ExportOptions, export_building
from objstate.interchange.importing import ImportOptions, ImportResult, import_building

__all__ = [
    "ExportOptions",
    "ImportOptions",
    "ImportResult",
    "export_building",
    "import_building",
]
