"""What the worker that ran a log leaves beside its result, so that nobody has to read that again."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from objstate.batch.rows import ROWS, rows_of
from objstate.building.model import Building
from objstate.errors import ObjstateError
from objstate.evaluation import batch as evaluation
from objstate.evaluation.sums import packed
from objstate.recording.batches import BatchLog
from objstate.recording.parts import truth_state, write_beside
from objstate.report import batch_part
from objstate.statistics import looks
from objstate.statistics.looks import OpenAbove


def write_parts(result: Path, log: BatchLog, read_from: Path, building: Building) -> None:
    """Write what the log adds to the figures of its batch; ``read_from`` is where it lies here.

    What can't be told here, as where the truth isn't on this machine, is left to whoever asks.
    """
    above = OpenAbove()
    made = {
        looks.kind_of(above, filtered=False): (
            looks.stamp_of(result, filtered=False),
            looks.looks_of(result, above),
        )
    }
    if log.truth is not None:
        with suppress(ObjstateError):
            sums = evaluation.judged_sums(result, replace(log, log=str(read_from)), building)
            stamp = evaluation.stamp_of(result, log, filtered=False)
            made[evaluation.kind_of(filtered=False)] = (stamp, packed(sums))
    with suppress(ObjstateError):
        done = batch_part.read_done(result, log, filtered=False)
        stamp = batch_part.part_of(result, log, filtered=False).stamp
        made[batch_part.kind_of(filtered=False)] = (stamp, batch_part.packed(done))
    rows = rows_of(result, log)
    if "truth_problem" not in json.loads(rows)["summary"]:
        made[ROWS] = (json.dumps(truth_state(log)), rows)
    write_beside(result, made)
