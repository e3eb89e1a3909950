"""Parquet files read back: whole and as expected, or an error that names the cure."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.errors import ResultError

if TYPE_CHECKING:
    import polars as pl


def read_parquet(
    path: Path, schema: pl.Schema, cure: str, optional: Collection[str] = ()
) -> pl.DataFrame:
    """The table at ``path``, which must have the columns of ``schema``; ``optional`` ones are null where they aren't there.

    Raises ResultError, which ends with the ``cure``, where there is none or another one.
    """
    import polars as pl

    if not path.is_file():
        raise ResultError(f"{path.parent} holds no {path.name}; {cure}.")
    try:
        frame = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise ResultError(
            f"{path} is not a Parquet file that can be read ({error}); {cure}."
        ) from error
    absent = {name: schema[name] for name in optional if name not in frame.columns}
    frame = frame.with_columns(pl.lit(None, kind).alias(name) for name, kind in absent.items())
    if dict(frame.schema) != dict(schema):
        raise ResultError(
            f"{path} has the columns {dict(frame.schema)} instead of {dict(schema)}; {cure}."
        )
    return frame.select(schema.names())
