"""The smoothed states of all estimates, and the movements of objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.objects import ObjectBelief
from objstate.recording.events import Event, write_events
from objstate.recording.tables import COLUMNS, SMOOTHED, estimate_schema, read_estimates
from objstate.smoothing import History, Movement, smoothed

if TYPE_CHECKING:
    import polars as pl

# columns that smoothing changes
STATES = ("mean", "std", "lower", "upper", "presence", "p_closed", "median")


def write_smoothed(folder: Path, histories: Mapping[str, History]) -> None:
    """Write ``smoothed.parquet``, which has the rows of the folder's estimates, and the events.

    Estimates of objects without a history stay as they are.
    """
    estimates = read_estimates(folder)
    parts, events = list["pl.DataFrame"](), list[Event]()
    for name, history in histories.items():
        own = estimates.filter(object=name)
        item = smoothed(history, own["stamp"].to_list())
        parts.append(_table(item.beliefs))
        events += [row for each in item.movements for row in _events(item.beliefs, each)]
    _replaced(estimates, parts).write_parquet(folder / SMOOTHED)
    write_events(folder, events)


def _table(beliefs: Sequence[ObjectBelief]) -> pl.DataFrame:
    """The states of an object at its moments, as rows of estimates."""
    import polars as pl

    rows = [row for belief in beliefs for row in belief.estimates(None)]
    columns = {
        "stamp": [row.stamp_ns for row in rows],
        "object": [row.object for row in rows],
        "coordinate": [row.coordinate for row in rows],
    } | {name: [getattr(row, name) for row in rows] for name in STATES}
    schema = estimate_schema()
    return pl.DataFrame(columns, schema={name: schema[name] for name in columns})


def _replaced(estimates: pl.DataFrame, parts: Sequence[pl.DataFrame]) -> pl.DataFrame:
    """The estimates with the states of the last moment at or before each.

    Those before the first moment of their object have the state of the first.
    """
    import polars as pl

    if not parts:
        return estimates
    keys = ["object", "coordinate"]
    states = pl.concat(parts)
    first = states.group_by(keys).agg(pl.col("stamp").min().alias("first"))
    known = estimates.with_row_index("row").join(first, on=keys, how="left")
    asked = known.with_columns(at=pl.max_horizontal("stamp", "first")).sort("at")
    renamed = states.rename({name: f"smoothed_{name}" for name in STATES}).sort("stamp")
    joined = asked.join_asof(
        renamed, left_on="at", right_on="stamp", by=keys, check_sortedness=False
    )
    is_smoothed = pl.col("first").is_not_null()
    changed = (
        pl.when(is_smoothed).then(f"smoothed_{name}").otherwise(name).alias(name) for name in STATES
    )
    return joined.sort("row").with_columns(*changed).select(COLUMNS)


def _events(beliefs: Sequence[ObjectBelief], movement: Movement) -> Iterator[Event]:
    """A movement as rows, one for each coordinate. Without a state where an object is absent."""
    before, after = beliefs[movement.before], beliefs[movement.after]
    was, is_there = before.presence >= 0.5, after.presence >= 0.5
    for k, coordinate in enumerate(before.item.coordinates):
        yield Event(
            object=before.item.name,
            kind="moved" if was and is_there else "came" if is_there else "left",
            coordinate=coordinate,
            from_ns=movement.from_ns,
            to_ns=movement.to_ns,
            from_state=float(before.mean[k]) if was else None,
            from_std=float(before.std[k]) if was else None,
            to_state=float(after.mean[k]) if is_there else None,
            to_std=float(after.std[k]) if is_there else None,
            probability=movement.probability,
        )
