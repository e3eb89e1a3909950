"""Parquet files that grow while a log goes by, in flat memory."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from types import TracebackType

    import polars as pl

ROWS_IN_MEMORY = 20_000  # about 5 MB; more are spilled to disk, so that a long log stays flat
ROWS_IN_GROUP = 100_000  # of the file that is written


class Spool:
    """Writes one Parquet file, row by row, in the order of writing.

    Use it as a context manager: the file is there when the block has ended
    without an error.
    """

    def __init__(self, path: Path, schema: pl.Schema, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        self.path = path
        self._parts = path.with_name(f".{path.name}.parts")
        self._rows_in_memory = rows_in_memory
        self._schema = schema
        self._columns: dict[str, list[Any]] = {name: [] for name in schema}
        self._spilled: list[Path] = []

    def write_columns(self, columns: Mapping[str, Sequence[Any]]) -> None:
        """Append rows given as equally long columns, named as in the file."""
        lengths = {name: len(values) for name, values in columns.items()}
        if set(columns) != set(self._schema) or len(set(lengths.values())) > 1:
            raise ValueError(f"columns {lengths}; give equally long {', '.join(self._schema)}")
        for name, values in columns.items():
            self._columns[name].extend(values)
        self._spill_when_full()

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

        frame = pl.DataFrame(self._columns, schema=self._schema)
        self._columns = {name: [] for name in self._schema}
        return frame

    def _spill_when_full(self) -> None:
        if len(next(iter(self._columns.values()))) < self._rows_in_memory:
            return
        self._parts.mkdir(exist_ok=True)
        part = self._parts / f"{len(self._spilled):06d}.parquet"
        self._take().write_parquet(part)
        self._spilled.append(part)

    def _finish(self) -> None:
        import polars as pl

        rest = self._take()
        if not self._spilled:
            rest.write_parquet(self.path, row_group_size=ROWS_IN_GROUP)
            return
        parts = pl.concat([pl.scan_parquet(self._spilled), rest.lazy()])
        parts.sink_parquet(self.path, row_group_size=ROWS_IN_GROUP, maintain_order=True)
