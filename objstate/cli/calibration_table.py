"""What a calibration found, for people."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.calibration import Calibration, LaserCorrection

# of each quantity: its label, its factor for display, and its decimals
SHOWN = (
    ("x", "cm", 100.0),
    ("y", "cm", 100.0),
    ("yaw", "deg", 180.0 / math.pi),
    ("clock", "ms", 1e3),
)


def describe_calibration(calibration: Calibration) -> Iterator[str | Table]:
    """The parts of the description, text and tables, in the order of reading."""
    title = "Corrections of mountings and clocks"
    table = new_table(title, ("laser", "of", "unit"), ("correction", "std", "told"))
    for laser in calibration.lasers:
        for row in _rows(laser):
            table.add_row(*row)
    yield table
    c = calibration
    yield (
        f"Odometry counts ways {100 * c.way_share:.1f} % too long (std "
        f"{100 * c.way_share_std:.1f}), its heading drifts by {math.degrees(c.drift):.2f} deg/m "
        f"(std {math.degrees(c.drift_std):.2f})."
    )
    yield (
        f"{c.scans} scans; readings spread by {100 * c.spread:.1f} cm about walls, walls by "
        f"{100 * c.wall_spread:.1f} cm about the model; {percent(c.used)} % of the readings are "
        "near walls."
    )
    for laser in calibration.lasers:
        yield f"--mount {laser.frame}={_mount(laser)}"
        yield f"--clock-offset {laser.frame}={laser.corrected_clock_offset:.4f}"


def _rows(laser: LaserCorrection) -> Iterator[tuple[str, ...]]:
    for k, (name, unit, factor) in enumerate(SHOWN):
        told = bool(laser.told[k])
        yield (
            laser.frame if k == 0 else "",
            name,
            unit,
            f"{factor * laser.correction[k]:.2f}" if told else "-",
            f"{factor * laser.std[k]:.2f}",
            "yes" if told else "no",
        )


def _mount(laser: LaserCorrection) -> str:
    from objstate.geometry import rpy_from_rotation

    mount = laser.corrected_mount
    numbers = [*mount[:3, 3], *rpy_from_rotation(mount[:3, :3])]
    return ",".join(f"{float(number):z.5g}" for number in numbers)
