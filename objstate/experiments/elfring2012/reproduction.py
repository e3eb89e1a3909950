"""The paper's experiment as a folder of tables and pictures."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from objstate.experiments.elfring2012.exploration import Exploration, explore
from objstate.experiments.elfring2012.falsifying import falsify
from objstate.experiments.elfring2012.games import METHODS, SPEEDS, shuffled, stages_at
from objstate.experiments.elfring2012.shuffling import Hiding, Stage
from objstate.experiments.elfring2012.tabling import falsified_table, games_table, paper_table
from objstate.experiments.reproduction import DPI, TABLES, Progress, check_plotting
from objstate.experiments.tables import Table
from objstate.recording.results import result_folder

TITLE = "Verification of a world model (Elfring et al. 2012)"
IN_A_ROW = 20  # shuffles of the game that is drawn
VERIFICATIONS = "verifications.csv"
VARIANCES, PATHS = "fig4_variances.png", "fig5_paths.png"


@dataclass(frozen=True)
class Reproduction:
    """What came of everything."""

    exploration: Exploration
    tables: tuple[Table, ...]


def reproduce(
    shuffles: int,
    trials: int,
    *,
    out: str | Path | None = None,
    seed: int = 0,
    stages: Mapping[Stage, Sequence[float]] | None = None,
    processes: int = 1,
    overwrite: bool = False,
    on_progress: Progress | None = None,
) -> Reproduction:
    """The table, ``trials`` falsifications of each case and ``shuffles`` of each kind.

    A folder ``out`` gets ``tables.md``, ``verifications.csv`` and pictures, whole or not at all.
    Same seed: same bytes, by any number of processes. Raises ResultError, and SettingsError where
    matplotlib is missing.
    """
    stages = stages_at(SPEEDS) if stages is None else stages
    if out is None:
        return _reproduced(shuffles, trials, seed, stages, processes, on_progress)
    check_plotting()
    with result_folder(out, overwrite=overwrite) as folder:
        result = _reproduced(shuffles, trials, seed, stages, processes, on_progress)
        _write(result, folder)
    return result


def _reproduced(
    shuffles: int,
    trials: int,
    seed: int,
    stages: Mapping[Stage, Sequence[float]],
    processes: int,
    on_progress: Progress | None,
) -> Reproduction:
    def report(share: float) -> None:
        if on_progress is not None:
            on_progress(share, 0.0)

    found = explore(seed, shuffles=min(shuffles, IN_A_ROW))
    report(0.03)
    falsified, tallies = list(falsify(trials, processes)), []
    report(0.1)
    kinds = len(Hiding) * len(METHODS) * sum(map(len, stages.values()))
    for tally in shuffled(shuffles, processes, stages):
        tallies.append(tally)
        report(0.1 + 0.9 * len(tallies) / kinds)
    tables = (paper_table(found), falsified_table(falsified), games_table(tallies))
    return Reproduction(found, tables)


def _write(result: Reproduction, folder: Path) -> None:
    from objstate.experiments.elfring2012.pictures import draw_paths, draw_variances

    found = result.exploration
    text = [f"# {TITLE}\n", *(table.markdown() for table in result.tables)]
    text += [f"![variances]({VARIANCES})", f"![paths]({PATHS})"]
    (folder / TABLES).write_text("\n".join(text) + "\n", encoding="utf-8")
    with (folder / VERIFICATIONS).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["time_s", "object", "answer"])
        writer.writerows(
            (f"{each.time:.4f}", each.object, each.answer) for each in found.verifications
        )
    for name, figure in ((VARIANCES, draw_variances(found)), (PATHS, draw_paths(found))):
        figure.savefig(folder / name, dpi=DPI, facecolor="white")
