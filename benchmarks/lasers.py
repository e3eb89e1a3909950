"""Errors with other lasers than the sample's: ``python benchmarks/lasers.py SCENE LASER SEED...``

The scene is driven with one laser of a kind that robots carry, instead of its own. The table is that of
``accuracy.py``; ``--settings FILE`` estimates with other settings than the defaults, as
``scans: {least_gap_s: 0, beam_spacing_deg: 0}``, with which all that was read is taken in.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path
from typing import Any

import yaml
from accuracy import study

from objstate.config import load_settings

LASERS: dict[str, dict[str, Any]] = {  # beams, angle of view (deg), Hz, m
    "round": {"beams": 360, "view": 360, "rate": 5.0, "range_max": 8.0},
    "slow": {"beams": 360, "view": 360, "rate": 2.0, "range_max": 12.0},
    "fine": {"beams": 541, "view": 270, "rate": 10.0, "range_max": 20.0},
    "fast": {"beams": 1080, "view": 270, "rate": 40.0, "range_max": 15.0},
}


def with_laser(scene: Path, kind: str, folder: Path) -> Path:
    """The scene, in a folder, with one laser of a kind."""
    laser, told = dict(LASERS[kind]), yaml.safe_load(scene.read_text())
    half, beams = math.radians(laser.pop("view")) / 2.0, laser["beams"]
    steps = beams if half == math.pi else beams - 1  # all round, the last beam is not the first
    fan = {"angle_min": -half, "angle_max": -half + 2.0 * half / steps * (beams - 1)}
    noise = {"range_min": 0.1, "sigma": 0.02, "false_share": 0.02}
    told["lasers"] = [{"frame": "laser", "mount": {"x": 0.1, "z": 0.25}, **laser, **fan, **noise}]
    told["building"] = str((scene.parent / told["building"]).resolve())
    out = folder / scene.name
    out.write_text(yaml.safe_dump(told))
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Errors with other lasers.")
    parser.add_argument("scene", type=Path)
    parser.add_argument("laser", choices=LASERS)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--settings", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = with_laser(given.scene, given.laser, Path(folder))
        study(scene, given.seeds, load_settings(given.settings))
