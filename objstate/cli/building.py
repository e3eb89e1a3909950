"""``objstate building from-map``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.options import Overwrite, help_when_alone

EXAMPLES = """\b
Example:
  objstate building from-map map.yaml --doors doors.csv --out out/building
\b
The columns of doors.csv:
  door                a name of your choice
  hinge_x, hinge_y    where the hinge stands in the map, m
  closed_bearing_deg  where the closed leaf points, seen from the hinge
  opens               ccw or cw, seen from above
  width_m             from the hinge to the free edge
  upper_limit_deg     the widest opening
"""

app = typer.Typer(help="Make buildings.", invoke_without_command=True, callback=help_when_alone)


@app.command("from-map", epilog=EXAMPLES)
def from_map(
    map_yaml: Annotated[Path, typer.Argument(metavar="MAP", help="A ROS map, YAML.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    doors: Annotated[
        Path | None, typer.Option(metavar="CSV", help="The doors; without it, walls only.")
    ] = None,
    wall_height: Annotated[float, typer.Option(help="Height of walls and doors, m.")] = 2.5,
    overwrite: Overwrite = False,
) -> None:
    """A building from a map and a table of doors.

    The occupied cells of a ROS occupancy map are extruded to walls; each row of the table becomes a
    door, and the leaf that the map shows in its swing area is cleared away.
    """
    from objstate.building import building_from_map

    urdf = building_from_map(map_yaml, doors, out, wall_height=wall_height, overwrite=overwrite)
    print_text(f"Written: {urdf}")
