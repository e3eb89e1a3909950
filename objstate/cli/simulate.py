"""``objstate simulate``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text, print_warnings
from objstate.cli.options import Overwrite, Quiet

EXAMPLES = """\b
Examples:
  objstate simulate models/corridor/corridor.scene.yaml --out out/drive
  objstate simulate office.scene.yaml --out out/office --format bag --seed 7
"""


def simulate(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="The scene, YAML.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    log_format: Annotated[
        str, typer.Option("--format", help="mcap, bag, rosbag2, rosbag2-mcap or carmen.")
    ] = "mcap",
    seed: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Instead of the scene's seed.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Make a log with known truth from a building and a scene.

    DIR gets the log, truth.csv (object states), path.tum (the robot's true path) and a copy of
    the scene.
    """
    from objstate.simulation import simulate as simulate_scene

    result = simulate_scene(scene, out, format=log_format, seed=seed, overwrite=overwrite)
    print_warnings(result.warnings, quiet)
    for topic, count in sorted(result.counts.items()):
        print_text(f"{count:8d}  {topic}")
    print_text(f"Written: {result.log} ({result.duration_s:.0f} s), with truth.csv and path.tum")
