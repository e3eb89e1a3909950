"""The conditions of an observation: distance, incidence, number of beams.

From the estimated path and states, the building and the log; a result needn't hold them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.building import outline
from objstate.building.model import Building, Kind, MovableObject
from objstate.geometry import FloatArray, IntArray, invert
from objstate.logs import open_log
from objstate.records import Path as RobotPath
from objstate.records import Scan
from objstate.sensing import ExpectedRanges

if TYPE_CHECKING:
    import polars as pl

MOST_COUNTED = 40  # updates of one object in one log whose beams are counted, evenly spread
NEAREST = 1e-9  # m; the robot is never nearer to the middle of an object


def no_conditions() -> pl.DataFrame:
    """The table of conditions without a row."""
    import polars as pl

    return pl.DataFrame(schema=_schema() | {"beams": pl.Int64()})


@dataclass(frozen=True, eq=False)
class Sides:
    """What a level laser sees of an object: its outline in the frame of its link."""

    item: MovableObject
    segments: FloatArray  # (k, 2, 2) m

    @staticmethod
    def of(item: MovableObject, height: float) -> Sides:
        """The outline at ``height`` m above the floor."""
        home = item.transforms(item.home[None])[0]
        cut = outline(item.mesh, height, home)
        placed = np.concatenate([cut, np.full((*cut.shape[:2], 1), height)], axis=2)
        into = invert(home)
        return Sides(item, (placed @ into[:3, :3].T + into[:3, 3])[..., :2])

    def at(self, states: FloatArray) -> FloatArray:
        """(n, k, 2, 2) the outline in the building, in states (n, d)."""
        matrices = self.item.transforms(states)
        turned = np.einsum("nij,ksj->nksi", matrices[:, :2, :2], self.segments)
        return np.asarray(turned + matrices[:, None, None, :2, 3])


def conditions(
    judged: pl.DataFrame, building: Building, path: RobotPath, log: Path | None
) -> pl.DataFrame:
    """A row for each observed object and stamp of ``judged``, under what conditions it was seen.

    ``distance``, m, is from the robot to the middle of the object; ``incidence``, rad,
    between the line of sight and the normal of a door's leaf, 0 head-on; ``beams``, how
    many beams of the scan should meet the object in its estimated state before any wall,
    counted for some of the updates if the ``log`` is given. Raises LogError where that
    can't be read.
    """
    import polars as pl

    observed = judged.filter("observed")
    seen = {
        name: part
        for (name,), part in sorted(observed.partition_by("object", as_dict=True).items())
        if name in building.objects
    }
    counted = {name: _evenly(part["stamp"].unique().to_numpy()) for name, part in seen.items()}
    scans = {} if log is None else _scans(log, {s for each in counted.values() for s in each})
    height = _laser_height(scans.values())
    expected = ExpectedRanges(building)
    tables = [
        _of_object(building[name], part, path, height).join(
            _beams(expected, name, part, path, {s: scans[s] for s in counted[name] if s in scans}),
            on="stamp",
            how="left",
        )
        for name, part in seen.items()
    ]
    return pl.concat(tables) if tables else no_conditions()


def _schema() -> dict[str, Any]:
    import polars as pl

    texts = {"object": pl.String(), "class": pl.String()}
    return {"stamp": pl.Int64()} | texts | {"distance": pl.Float64(), "incidence": pl.Float64()}


def _of_object(
    item: MovableObject, part: pl.DataFrame, path: RobotPath, height: float | None
) -> pl.DataFrame:
    import polars as pl

    stamps, states = _states(item, part)
    places = Sides.of(item, _middle_height(item) if height is None else height).at(states)
    sight = places.mean(axis=(1, 2)) - _poses(path, stamps)[:, :2]
    return pl.DataFrame(
        {
            "stamp": stamps,
            "object": [item.name] * len(stamps),
            "class": ["furniture" if item.kind is Kind.PLANAR else "door"] * len(stamps),
            "distance": np.hypot(*sight.T),
            "incidence": _incidence(item, places, sight),  # None: all null
        },
        schema=_schema(),
    )


def _states(item: MovableObject, part: pl.DataFrame) -> tuple[IntArray, FloatArray]:
    """Stamps (n,) at which all coordinates are known, and the estimated states (n, d)."""
    wide = part.pivot("coordinate", index="stamp", values="median").drop_nulls().sort("stamp")
    if not set(item.coordinates) <= set(wide.columns):
        return np.zeros(0, dtype=np.int64), np.zeros((0, len(item.coordinates)))
    return wide["stamp"].to_numpy(), wide.select(item.coordinates).to_numpy()


def _incidence(item: MovableObject, places: FloatArray, sight: FloatArray) -> FloatArray | None:
    """(n,) rad; None for what has no one face."""
    if item.kind is Kind.PLANAR or not places.shape[1]:
        return None
    along = places[:, :, 1] - places[:, :, 0]
    lengths = np.linalg.norm(along, axis=2)
    leaf = along[np.arange(len(along)), lengths.argmax(axis=1)] / lengths.max(axis=1)[:, None]
    distance = np.maximum(np.hypot(*sight.T), NEAREST)
    sideways = np.abs(np.sum(leaf * sight, axis=1)) / distance
    return np.asarray(np.arcsin(np.minimum(sideways, 1.0)))


def _beams(
    expected: ExpectedRanges,
    name: str,
    part: pl.DataFrame,
    path: RobotPath,
    scans: Mapping[int, Scan],
) -> pl.DataFrame:
    """How many beams of some scans should meet an object in its estimated states."""
    import polars as pl

    stamps, states = _states(expected.building[name], part)
    poses = _poses(path, stamps)
    counts = {}
    for stamp, state, pose in zip(stamps.tolist(), states, poses, strict=True):
        if stamp in scans:
            rays, reach = scans[stamp].rays, scans[stamp].range_max
            walls = expected.walls(pose[None], rays)[0]
            ranges = expected.object(name, state[None], pose[None], rays)[0, 0]
            counts[stamp] = int(np.count_nonzero(ranges < np.minimum(walls, reach)))
    return pl.DataFrame(
        {"stamp": list(counts), "beams": list(counts.values())},
        schema={"stamp": pl.Int64(), "beams": pl.Int64()},
    )


def _scans(log: Path, stamps: set[int]) -> dict[int, Scan]:
    """The scans with these stamps."""
    return {
        record.stamp_ns: record
        for record in open_log(log)
        if isinstance(record, Scan) and record.stamp_ns in stamps and len(record)
    }


def _laser_height(scans: Iterable[Scan]) -> float | None:
    return next((float(scan.rays.origins[0, 2]) for scan in scans), None)


def _middle_height(item: MovableObject) -> float:
    heights = item.mesh.moved(item.transforms(item.home[None])[0]).vertices[:, 2]
    return float(heights.min() + heights.max()) / 2


def _poses(path: RobotPath, stamps: IntArray) -> FloatArray:
    """(n, 3) the robot's poses at the scans with these stamps."""
    place = np.searchsorted(path.stamps_ns, stamps).clip(max=len(path.stamps_ns) - 1)
    return np.asarray(path.poses[place])


def _evenly(stamps: IntArray) -> list[int]:
    step = max(1, -(-len(stamps) // MOST_COUNTED))
    return [int(stamp) for stamp in np.sort(stamps)[::step]]
