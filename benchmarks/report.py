"""How long the report of a long log takes, and how large it gets.

    .venv/bin/python benchmarks/report.py           # a robot that passes 30 doors for an hour
    .venv/bin/python benchmarks/report.py --always  # all doors near all the time

The result folder is synthetic: it is written as a run would write it, without a log.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from objstate.building import load_building
from objstate.building.door_table import Door
from objstate.building.model import Mesh
from objstate.building.shapes import Box
from objstate.building.writing import write_building
from objstate.geometry import transform
from objstate.recording.posteriors import Histogram, PosteriorWriter
from objstate.recording.results import result_folder
from objstate.recording.scans import ScanWriter, ThinScan
from objstate.recording.summary import write_summary
from objstate.recording.tables import EstimateWriter, write_truth
from objstate.recording.tum import write_tum
from objstate.records import Estimate, TrueState
from objstate.records import Path as RobotPath
from objstate.report import write_report
from objstate.run import RunOptions
from objstate.run.inputs import describe_building, describe_truth, seen_from

DOORS, HOURS, RATE = 30, 1.0, 10.0  # scans a second
PITCH, SPEED, NEAR = 2.5, 0.7, 3.5  # m between doors, m/s, m
BEGIN_NS = 1_600_000_000_000_000_000
UPPER, BINS = 1.8, 64  # rad


def main() -> None:
    """Write a result, report it, print time and size."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--always", action="store_true")
    always = parser.parse_args().always
    with tempfile.TemporaryDirectory() as scratch:
        folder = write_result(Path(scratch), always)
        began = time.perf_counter()
        page = write_report(folder)
        took = time.perf_counter() - began
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{took:.1f} s, {page.stat().st_size / 1e6:.2f} MB, {memory:.0f} MB of memory at most"
        )


def write_result(scratch: Path, always: bool) -> Path:
    """A result folder of an hour along a corridor, there and back again."""
    urdf = write_corridor(scratch / "building")
    rng = np.random.default_rng(0)
    seconds = np.arange(int(HOURS * 3600 * RATE)) / RATE
    stamps = BEGIN_NS + (seconds * 1e9).astype(np.int64)
    length = DOORS * PITCH
    way = (SPEED * seconds) % (2 * length)
    x = np.where(way < length, way, 2 * length - way)
    truth = scratch / "truth.csv"
    angles = rng.uniform(0.1, UPPER - 0.1, DOORS)
    write_truth(truth, (TrueState(BEGIN_NS, f"door_{k}", "angle", angles[k]) for k in range(DOORS)))
    with result_folder(scratch / "result") as folder:
        count = write_tables(folder, stamps, x, angles, always, rng)
        poses = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
        write_tum(folder / "trajectory.tum", RobotPath(stamps, poses))
        out = scratch / "result"
        write_summary(folder, summary(urdf, truth, out, count))
    return scratch / "result"


def write_tables(
    folder: Path,
    stamps: np.ndarray,
    x: np.ndarray,
    angles: np.ndarray,
    always: bool,
    rng: np.random.Generator,
) -> int:
    """Estimates with every scan and posteriors each second, of the doors that are near."""
    count = 0
    edges = np.linspace(0.0, UPPER, BINS + 1)
    ends = 3.0 * np.random.default_rng(1).standard_normal((80, 2))
    with (
        EstimateWriter(folder) as estimates,
        PosteriorWriter(folder) as posteriors,
        ScanWriter(folder) as scans,
    ):
        for k, stamp in enumerate(stamps.tolist()):
            near = [d for d in range(DOORS) if always or abs((d + 0.5) * PITCH - x[k]) < NEAR]
            means = angles[near] + rng.normal(0.0, 0.02, len(near))
            estimates.write(
                [
                    Estimate(stamp, f"door_{d}", "angle", m, 0.02, m - 0.033, m + 0.033, k % 3 > 0)
                    for d, m in zip(near, means.tolist(), strict=True)
                ]
            )
            count += len(near)
            if k % RATE == 0:
                scans.write([ThinScan(stamp, "laser", ends)])
                posteriors.write(
                    [
                        Histogram(stamp, f"door_{d}", "angle", 0.0, UPPER, bell(edges, m))
                        for d, m in zip(near, means.tolist(), strict=True)
                    ]
                )
    return count


def bell(edges: np.ndarray, mean: float) -> np.ndarray:
    """A Gaussian over the bins."""
    from scipy.special import ndtr

    return np.diff(ndtr((edges - mean) / 0.02))


def write_corridor(out: Path) -> Path:
    """Two walls of boxes with a gap for each door in one of them."""
    length = DOORS * PITCH
    boxes = [((length, 0.1, 2.5), (length / 2, -1.2, 1.25))]
    gap = [
        ((PITCH - 0.9, 0.1, 2.5), (k * PITCH + (PITCH - 0.9) / 2, 1.2, 1.25)) for k in range(DOORS)
    ]
    parts = [Box(size).mesh().moved(transform(np.eye(3), place)) for size, place in boxes + gap]
    doors = [
        Door(f"door_{k}", ((k + 1) * PITCH - 0.9, 1.2), 0.0, 1, 0.9, UPPER) for k in range(DOORS)
    ]
    return write_building(out, "corridor", Mesh.joined(parts), doors, 0.04, 2.0)


def summary(urdf: Path, truth: Path, out: Path, estimates: int) -> dict[str, object]:
    """What run.json would say."""
    building = load_building(urdf)
    return {
        "version": "0",
        "objects": list(building.objects),
        "begin_ns": BEGIN_NS,
        "timings": {"log_seconds": HOURS * 3600, "elapsed_seconds": 1.0},
        "counts": {"estimates": estimates},
        "warnings": [],
        "lost_ns": [],
        "laser_heights": {"laser": 0.3},
        "options": RunOptions().to_dict(),
        "inputs": {
            "logs": [],
            "building": seen_from(out, describe_building(urdf, building)),
            "truth": seen_from(out, describe_truth(truth, None)["truth"]),
        },
    }


if __name__ == "__main__":
    main()
