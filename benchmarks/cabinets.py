"""Doors beside new cabinets: ``python -m benchmarks.cabinets SEED...``

In the sample corridor, cabinets that the model doesn't have stand beside seven doors of fourteen, or
before them. A first drive with ``--grid`` finds them; each candidate that is probably real is added
to the building as furniture, as ``objstate world adopt`` does. A second drive, on which other doors
are open, is estimated with the building as it was and with the candidates.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import yaml

from objstate.building import load_building
from objstate.building.adding import with_box
from objstate.evaluation import latest_states
from objstate.recording.candidates import read_candidates
from objstate.recording.tables import read_estimates, read_truth
from objstate.run import estimate_log
from objstate.simulation import simulate

SCENE = Path(__file__).parents[1] / "models/corridor/corridor.scene.yaml"
SIZE = (0.6, 0.35, 1.2)  # m
ALONG = (-0.5, 0.5, 1.5)  # where a cabinet stands, of the doorway's width from the hinge
BEFORE = 0.08  # m between wall and cabinet
DOORS = 7


def cabinets(seed: int) -> tuple[list[dict], dict[str, float]]:
    """The scene's boxes, and where each stands beside its door."""
    building, rng = load_building(SCENE.with_name("corridor.urdf")), np.random.default_rng(seed)
    boxes, beside = [], {}
    for name in rng.permutation(sorted(building.objects))[:DOORS]:
        item = building[name]
        leaf = item.transforms(np.array([[0.0]]))[0, :2, :2] @ item.mesh.vertices[:, :2].T
        tip = leaf[:, np.argmax(np.hypot(*leaf))]
        along = tip * [1.0, 0.0]  # the corridor leads along x
        inward = np.array([0.0, -np.sign(item.hinge[1])])
        share = float(rng.choice(ALONG))
        at = item.hinge + share * along + (SIZE[1] / 2 + BEFORE) * inward
        pose = {"x": float(at[0]), "y": float(at[1]), "yaw": 0.0}
        boxes.append({"pose": pose, "size": list(SIZE)})
        beside[str(name)] = share
    return boxes, beside


def drives(seed: int, folder: Path) -> dict[str, float]:
    """Two drives past the same cabinets."""
    boxes, beside = cabinets(seed)
    scene = yaml.safe_load(SCENE.read_text()) | {"boxes": boxes}
    scene["building"] = str(SCENE.with_name("corridor.urdf"))
    scene["objects"] = [{"name": "door_*", "initial": "random"}]
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    for day in (1, 2):
        simulate(folder / "scene.yaml", folder / f"drive{day}", seed=10 * seed + day)
    return beside


def adopted(folder: Path) -> tuple[Path, int]:
    """The building with the candidates of the first drive."""
    urdf = SCENE.with_name("corridor.urdf")
    estimate_log([folder / "drive1" / "log.mcap"], urdf, folder / "first", grid=True)
    text, count = urdf.read_text(), 0
    for each in read_candidates(folder / "first"):
        pose = np.array([each.x, each.y, each.yaw])
        text = with_box(text, each.name, pose, (each.length, each.width, SIZE[2]))
        count += 1
    (folder / "grown.urdf").write_text(text)
    return folder / "grown.urdf", count


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+")
    found = defaultdict(list)
    for seed in parser.parse_args().seeds:
        with tempfile.TemporaryDirectory() as text:
            folder = Path(text)
            beside = drives(seed, folder)
            grown, count = adopted(folder)
            print(f"seed {seed}: {count} candidates for {DOORS} cabinets", flush=True)
            truth = read_truth(folder / "drive2" / "truth.csv")
            buildings = {"as it was": SCENE.with_name("corridor.urdf"), "with candidates": grown}
            for kind, urdf in buildings.items():
                estimate_log([folder / "drive2" / "log.mcap"], urdf, folder / kind)
                for each in latest_states(read_estimates(folder / kind), truth, ()):
                    row = each.estimate
                    if each.error is None or not row.observed:
                        continue
                    place = "before" if beside.get(row.object) == 0.5 else "beside"
                    where = place if row.object in beside else "no cabinet"
                    held = row.lower <= each.truth <= row.upper
                    found[where, kind].append((np.degrees(abs(each.error)), held))
    print("| doors | building | angles | error: mean, median, largest (deg) | in 90 % interval |")
    print("| --- | --- | --- | --- | --- |")
    for (where, kind), rows in sorted(found.items()):
        off = np.array([row[0] for row in rows])
        held = np.mean([row[1] for row in rows])
        print(
            f"| {where} | {kind} | {len(off)} | {off.mean():.2f}, {np.median(off):.2f}, "
            f"{off.max():.2f} | {held:.0%} |"
        )


if __name__ == "__main__":
    main()
