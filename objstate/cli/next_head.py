"""``objstate next --head``: where to turn a sensor."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.cli.console import print_table, print_text
from objstate.cli.parsing import parse_way
from objstate.cli.sensors import parse_head
from objstate.cli.tables import new_table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.table import Table

    from objstate.building.model import Building
    from objstate.gaze.field import Gaze, Head
    from objstate.geometry import FloatArray
    from objstate.grid import Layout
    from objstate.world import Snapshot

NAMED = 3  # parts of a view that are named
MARGIN = 0.5  # m about the walls, of a grid where none is given


def show_gazes(
    building: Building,
    moment: Snapshot,
    pose: FloatArray,
    text: str,
    grid: Path | None,
    way: str | None,
    position_std: float,
    top: int,
    *,
    as_json: bool,
) -> None:
    """Print the best headings of a head on a robot at a pose (3,), under a moment's beliefs."""
    import numpy as np

    from objstate.building.outline import outline
    from objstate.config import GridSettings
    from objstate.gaze.field import EntropyMap, Gazer, ObjectGains, corners
    from objstate.gaze.floor import FloorSettings

    head, planned = parse_head(text), None if way is None else parse_way(way)
    walls = outline(building.walls, head.sensor.height).reshape(-1, 4)
    layout, values = _grid(grid, walls, moment)
    _require_inside(layout, pose)
    entropies = EntropyMap(layout, walls, corners(walls), objects=False)
    if planned is not None:
        entropies.watch(np.vstack([pose[:2], planned]), FloorSettings().robot_radius)
    unreliability = min(1.0, position_std / GridSettings.max_position_std)
    entropies.update(values, moment.beliefs, unreliability)
    gains = ObjectGains(building, head, moment.world.settings)
    gazes = Gazer(entropies, head, gains=gains).rank(pose, head.sensor.yaw, 0.0, top)
    if as_json:
        _print_json(gazes)
    else:
        print_table(_table(head, gazes))


def _require_inside(layout: Layout, pose: FloatArray) -> None:
    """Raises GridError where the map doesn't show the place of the robot."""
    from objstate.errors import GridError

    if not layout.within(layout.to_cells(pose[:2])):
        raise GridError(
            f"The robot at ({pose[0]:g}, {pose[1]:g}) m is not on the map; check --at, and that --grid "
            "is of this building."
        )


def _grid(
    path: Path | None, walls: FloatArray, moment: Snapshot
) -> tuple[Layout, NDArray[np.float32]]:
    """The cells, and P(occupied) of each: of a file, else as the world's newest drive left them."""
    import numpy as np

    from objstate.building.occupancy import read_probabilities
    from objstate.config import GridSettings
    from objstate.grid import Layout

    if path is not None:
        values, resolution, origin = read_probabilities(path)
        rows, columns = values.shape
        return Layout(resolution, rows, columns, origin), values
    for kept in reversed(moment.world.floors):
        if kept.stamp_ns <= moment.stamp_ns < kept.forgotten_ns:
            floor = kept.memory
            return floor.layout, floor.values(moment.stamp_ns).astype(np.float32)
    layout = Layout.around(walls.reshape(-1, 2), GridSettings().resolution_m, MARGIN)
    return layout, np.full(layout.shape, 0.5, dtype=np.float32)


def _table(head: Head, gazes: list[Gaze]) -> Table:
    numbers = ("turn to", "heading", "bits", "s", "bits/s")
    table = new_table(f"Where to turn '{head.sensor.name}'", ("shows",), numbers)
    for each in gazes:
        shows = ", ".join(f"{name} {bits:.1f}" for name, bits in list(each.parts.items())[:NAMED])
        angles = _degrees(each.pan), _degrees(each.heading)
        table.add_row(shows, *angles, f"{each.bits:.1f}", f"{each.seconds:.2f}", f"{each.rate:.1f}")
    return table


def _print_json(gazes: list[Gaze]) -> None:
    """Print headings for programs."""
    print_text(json.dumps({"gazes": [_words(each) for each in gazes]}, indent=2))


def _words(gaze: Gaze) -> dict[str, Any]:
    return {
        "pan": gaze.pan,
        "heading": gaze.heading,
        "bits": gaze.bits,
        "seconds": gaze.seconds,
        "rate": gaze.rate,
        "parts": gaze.parts,
    }


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.0f}deg"
