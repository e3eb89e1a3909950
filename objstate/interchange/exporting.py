"""``objstate building export``: a building as a file of another tool."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from objstate.building.assembly import load_building
from objstate.building.model import Building
from objstate.building.sidecar import sidecar_path
from objstate.building.writing import building_folder, check_output
from objstate.errors import BuildingError
from objstate.interchange.imported import Notes
from objstate.interchange.to_map import write_occupancy
from objstate.interchange.to_rmf import write_rmf
from objstate.interchange.to_sdf import write_sdf

HEIGHT = 0.3  # m above the floor, where many robots carry their laser
RESOLUTION = 0.05  # m, most maps'
FINEST = 1e-3  # m


@dataclass(frozen=True)
class ExportOptions:
    """What the formats need beside the building."""

    height: float = HEIGHT  # m, of the laser that sees what is drawn
    resolution: float = RESOLUTION  # m, of a map's cells
    objects: bool = False  # whether a map shows objects, in their home


Writer = Callable[[Path, Building, ExportOptions, Notes], None]

WRITERS: dict[str, Writer] = {
    "map": lambda out, building, options, notes: write_occupancy(
        out, building, options.height, options.resolution, options.objects, notes
    ),
    "sdf": lambda out, building, _, notes: write_sdf(out, building, notes),
    "rmf": lambda out, building, options, notes: write_rmf(out, building, options.height, notes),
}


def export_building(
    urdf: str | Path,
    out_dir: str | Path,
    to: str,
    options: ExportOptions | None = None,
    *,
    overwrite: bool = False,
) -> Notes:
    """Write a building to the folder ``out_dir`` in the format ``to``, all or nothing.

    Returns what was taken and what wasn't. ``out_dir`` must not exist, unless it holds only what
    objstate wrote and ``overwrite`` is set. Raises BuildingError, and ResultError if it can't be
    written.
    """
    if to not in WRITERS:
        raise BuildingError(f"'{to}' is no format to export to; give one of {', '.join(WRITERS)}.")
    options = options or ExportOptions()
    if not FINEST <= options.resolution <= 1.0:
        raise BuildingError(
            f"The resolution is {options.resolution:g} m; give one from {FINEST:g} to 1 m."
        )
    out = Path(out_dir)
    check_output(out, overwrite, urdf)
    building, notes = load_building(urdf), Notes()
    with building_folder(out) as made:
        WRITERS[to](made, building, options, notes)
    if building.error is not None:
        notes.left.append(f"{sidecar_path(Path(urdf)).name}, as the format has no deviations.")
    return notes
