"""Makes many one-minute drives along the sample corridor: ``python benchmarks/minute_logs.py DIR COUNT``

Every drive has its own seed, so that doors stand otherwise and noise falls otherwise, and lies in a
folder of its own with its truth. What is there already is kept.
"""

from __future__ import annotations

import sys
from pathlib import Path

from objstate.simulation import simulate
from objstate.simulation.scene import Route, Waypoint, dump_scene, load_scene

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor" / "corridor.scene.yaml"
ONE_WAY = Route(  # of the corridor, end to end: 60 s
    speed=0.7,
    waypoints=(Waypoint(x=1.5, y=0.0, pause=3.0), Waypoint(x=38.5, y=0.0, pause=2.0)),
)


def make(folder: Path, count: int) -> None:
    """Simulate the drives ``folder/drive_000`` and so on."""
    scene = load_scene(CORRIDOR)
    folder.mkdir(parents=True, exist_ok=True)
    written = folder / "one_way.scene.yaml"
    written.write_text(dump_scene(scene.model_copy(update={"route": ONE_WAY})), encoding="utf-8")
    for seed in range(count):
        out = folder / f"drive_{seed:03d}"
        if not out.exists():
            print(simulate(written, out, seed=seed).log, flush=True)


if __name__ == "__main__":
    make(Path(sys.argv[1]), int(sys.argv[2]))
