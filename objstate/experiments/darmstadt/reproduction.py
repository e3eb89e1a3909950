"""The thesis' experiments as a folder of tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from objstate.errors import SettingsError
from objstate.experiments.darmstadt.accuracy import measure, validate
from objstate.experiments.darmstadt.tabling import accuracy_table, validity_table
from objstate.experiments.reproduction import TABLES, Progress, check_plotting
from objstate.experiments.tables import Table
from objstate.recording.results import result_folder

TITLE = "Occupancy that ages, and active gaze (Darmstadt Dribblers)"
ACCURACY_S = 30.0  # s of a recording


@dataclass(frozen=True)
class Reproduction:
    """What came of the experiments that were asked for."""

    tables: tuple[Table, ...]


def reproduce(
    seeds: Sequence[int],
    *,
    out: str | Path | None = None,
    only: Sequence[str] = (),
    processes: int = 1,
    overwrite: bool = False,
    on_progress: Progress | None = None,
) -> Reproduction:
    """Experiments of chapter 7, all or those named, for every seed.

    A folder ``out`` gets ``tables.md`` and pictures, whole or not at all. Same seeds: same bytes, by
    any number of processes. Raises ResultError, and SettingsError for an unknown experiment or where
    matplotlib is missing.
    """
    unknown = [name for name in only if name not in EXPERIMENTS]
    if unknown:
        raise SettingsError(
            f"There is no experiment '{unknown[0]}'; choose from {', '.join(EXPERIMENTS)}."
        )
    chosen = [name for name in EXPERIMENTS if name in only or not only]
    if out is None:
        return _reproduced(chosen, seeds, processes, on_progress)
    check_plotting()
    with result_folder(out, overwrite=overwrite) as folder:
        result = _reproduced(chosen, seeds, processes, on_progress)
        text = [f"# {TITLE}\n", *(table.markdown() for table in result.tables)]
        (folder / TABLES).write_text("\n".join(text) + "\n", encoding="utf-8")
    return result


def _reproduced(
    chosen: Sequence[str], seeds: Sequence[int], processes: int, on_progress: Progress | None
) -> Reproduction:
    tables: list[Table] = []
    for done, name in enumerate(chosen, 1):
        tables += EXPERIMENTS[name](seeds, processes)
        if on_progress is not None:
            on_progress(done / len(chosen), 0.0)
    return Reproduction(tuple(tables))


def _accuracy(seeds: Sequence[int], processes: int) -> Iterator[Table]:
    yield validity_table(list(validate(seeds, ACCURACY_S, processes)))
    yield accuracy_table(list(measure(seeds, ACCURACY_S, processes)))


EXPERIMENTS: Mapping[str, Callable[[Sequence[int], int], Iterator[Table]]] = {
    "accuracy": _accuracy,
}
