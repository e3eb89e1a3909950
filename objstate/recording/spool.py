"""Parquet files that grow while a log is read, in constant memory."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar

if TYPE_CHECKING:
    from types import TracebackType

    import polars as pl

ROWS_IN_GROUP = 100_000  # of the file that is written

Row = TypeVar("Row")


class Spool(Generic[Row]):
    """Writes one Parquet file, row by row, in the order of writing.

    ``columns`` makes equally long columns of rows, named as in ``schema``. Of ``rows_in_memory``
    or more, all are spilled to disk, so that a long log stays flat. Use it as a context manager:
    the file is there when the block has ended without an error.
    """

    def __init__(
        self,
        path: Path,
        schema: pl.Schema,
        columns: Callable[[Sequence[Row]], Mapping[str, Sequence[Any]]],
        rows_in_memory: int,
    ) -> None:
        self.path = path
        self._parts = path.with_name(f".{path.name}.parts")
        self._schema = schema
        self._columns = columns
        self._rows_in_memory = rows_in_memory
        self._rows: list[Row] = []
        self._spilled: list[Path] = []

    def write(self, rows: Iterable[Row]) -> None:
        """Append rows."""
        self._rows.extend(rows)
        if len(self._rows) >= self._rows_in_memory:
            self._spill()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                self._finish()
        finally:
            shutil.rmtree(self._parts, ignore_errors=True)

    def _take(self) -> pl.DataFrame:
        import polars as pl

        frame = pl.DataFrame(self._columns(self._rows), schema=self._schema)
        self._rows = []
        return frame

    def _spill(self) -> None:
        self._parts.mkdir(exist_ok=True)
        part = self._parts / f"{len(self._spilled):06d}.parquet"
        self._take().write_parquet(part)
        self._spilled.append(part)

    def _finish(self) -> None:
        import polars as pl

        rest = self._take().lazy()
        if not self._spilled:
            self._finished(rest).collect().write_parquet(self.path, row_group_size=ROWS_IN_GROUP)
            return
        parts = self._finished(pl.concat([pl.scan_parquet(self._spilled), rest]))
        parts.sink_parquet(self.path, row_group_size=ROWS_IN_GROUP, maintain_order=True)

    def _finished(self, rows: pl.LazyFrame) -> pl.LazyFrame:
        """All rows as they are written at the end."""
        return rows
