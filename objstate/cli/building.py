"""``objstate building from-map``"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from objstate.cli import building_edit, building_learn
from objstate.cli.console import print_list, print_problems, print_text
from objstate.cli.options import Overwrite, help_when_alone
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.interchange.imported import Notes

EXAMPLES = """\b
Example:
  objstate building from-map map.yaml --doors doors.csv --out out/building
\b
The columns of doors.csv:
  door                a name of your choice
  hinge_x, hinge_y    where the hinge stands in the map, m; of a leaf that slides,
                      its end past which it slides open
  closed_bearing_deg  where the closed leaf points, seen from the hinge
  opens               ccw or cw, seen from above, or slides
  width_m             from the hinge to the free edge
  upper_limit_deg     the widest opening; empty if it slides
  upper_limit_m       if it slides, how far; its width, where this is missing
"""

IMPORT_EXAMPLES = """\b
Examples:
  objstate building import office.building.yaml --out out/office
  objstate building import hotel.building.yaml --level L1 --out out/hotel
  objstate building import home.world --models models --movable "chair*" --out out/home
\b
Read are:
  .yaml, .yml    Open-RMF buildings, as traffic-editor saves them
  .sdf, .world   worlds and models of Gazebo
  .ifc           building information models, through IfcOpenShell (pip install 'objstate[ifc]')
"""

EXPORT_EXAMPLES = """\b
Examples:
  objstate building export office.urdf --to map --resolution 0.05 --out out/map
  objstate building export office.urdf --to sdf --out out/world
"""

EXPORT_OPTIONS: dict[str, tuple[str, ...]] = {  # that have a meaning in each format
    "map": ("height", "resolution", "objects"),
    "rmf": ("height",),
    "sdf": (),
}

app = typer.Typer(help="Make buildings.", invoke_without_command=True, callback=help_when_alone)


@app.command("from-map", epilog=EXAMPLES)
def from_map(
    map_yaml: Annotated[
        Path, typer.Argument(metavar="MAP", help="A ROS map, YAML, or a log that holds /map.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    doors: Annotated[
        Path | None, typer.Option(metavar="CSV", help="The doors; without it, walls only.")
    ] = None,
    topic: Annotated[
        str | None, typer.Option(metavar="TOPIC", help="Of a log: where its map is. Default: /map.")
    ] = None,
    wall_height: Annotated[float, typer.Option(help="Height of the walls, m.")] = 2.5,
    door_height: Annotated[float, typer.Option(help="Height of the doors, m.")] = 2.0,
    leaf_thickness: Annotated[float, typer.Option(help="Of the doors' leaves, m.")] = 0.04,
    surface: Annotated[
        Literal["edge", "centre"],
        typer.Option(help="Where in the outermost occupied cells the walls' surface lies."),
    ] = "centre",
    tolerance: Annotated[
        float, typer.Option(help="How far walls may pass the cells, in cells.")
    ] = 0.75,
    min_cells: Annotated[
        int, typer.Option(help="Blobs of fewer occupied cells are speckle, and left out.")
    ] = 3,
    overwrite: Overwrite = False,
) -> None:
    """A building from a map and a table of doors.

    The occupied cells of a ROS occupancy map are extruded to walls; each row of the table becomes a
    door, but for candidates with a probability below 0.5, and the leaf that the map shows in its
    swing area is cleared away. Doors that don't stand in a doorway of the map are named, as
    `objstate inspect` does.
    """
    from objstate.building import building_from_map, inspect_building
    from objstate.conversion import recorded_map
    from objstate.logs.containers import is_log

    if topic is not None and not (map_yaml.exists() and is_log(map_yaml)):
        raise SettingsError(f"--topic is for logs, which {map_yaml} isn't; leave it out.")
    urdf = building_from_map(
        recorded_map(map_yaml, topic) if map_yaml.exists() and is_log(map_yaml) else map_yaml,
        doors,
        out,
        wall_height,
        door_height=door_height,
        leaf_thickness=leaf_thickness,
        surface=surface,
        tolerance=tolerance,
        min_cells=min_cells,
        overwrite=overwrite,
        report=print_text,
    )
    print_problems(inspect_building(urdf).problems)
    print_text(f"Written: {urdf}")


@app.command("import", epilog=IMPORT_EXAMPLES)
def import_file(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The building in another format.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    level: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="One level only; without it, a folder for each."),
    ] = None,
    models: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="A folder to search for model://; repeatable."),
    ] = None,
    movable: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Static models that are furniture; repeatable."),
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """A building from a file of another tool.

    Lists what of the file was taken and what wasn't, and what to check. Units, the axis that points
    up and the sense of rotation are those that the file states.
    """
    from objstate.building import inspect_building
    from objstate.interchange import ImportOptions, import_building

    options = ImportOptions(models or (), movable or ())
    result = import_building(file, out, level=level, options=options, overwrite=overwrite)
    _print_notes(result.notes)
    for urdf in result.buildings:
        print_problems(inspect_building(urdf).problems)
        print_text(f"Written: {urdf}")


@app.command("export", epilog=EXPORT_EXAMPLES)
def export(
    building: Annotated[Path, typer.Argument(metavar="BUILDING", help="The building, URDF.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    to: Annotated[Literal["map", "sdf", "rmf"], typer.Option(help="The format.")],
    height: Annotated[
        float | None,
        typer.Option(help="Of the laser that sees what is drawn, m (map, rmf). Default: 0.3."),
    ] = None,
    resolution: Annotated[
        float | None, typer.Option(help="Of a map's cells, m (map). Default: 0.05.")
    ] = None,
    objects: Annotated[
        bool,
        typer.Option("--objects", help="Draw doors and furniture as modelled (map)."),
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """A building as a ROS map, a Gazebo world or an Open-RMF building.

    Lists what was exported and what the format can't hold.
    """
    from objstate.interchange import ExportOptions, export_building

    stated = {"height": height, "resolution": resolution, "objects": objects or None}
    given: dict[str, Any] = {name: value for name, value in stated.items() if value is not None}
    for name in given:
        if name not in EXPORT_OPTIONS[to]:
            raise SettingsError(f"--{name} has no meaning with --to {to}; leave it out.")
    options = ExportOptions(**given)
    _print_notes(export_building(building, out, to, options, overwrite=overwrite))
    print_text(f"Written: {out}")


def _print_notes(notes: Notes) -> None:
    print_list("Taken:", notes.taken)
    print_list("Not taken:", notes.left)
    print_list("To check:", notes.doubts)


app.command("edit", epilog=building_edit.EXAMPLES)(building_edit.edit)
app.command("learn", epilog=building_learn.EXAMPLES)(building_learn.learn)
