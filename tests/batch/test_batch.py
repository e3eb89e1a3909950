"""Whole batches: what lies in the folder, also after failures, changes and interruptions."""

import shutil
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import polars as pl
import pytest

from objstate.batch import (
    BatchOptions,
    Ended,
    Leftover,
    Progressed,
    Requested,
    gather,
    run_batch,
)
from objstate.batch.addresses import fetched, size_of
from objstate.config import Settings
from objstate.errors import OutageError, ResultError
from objstate.evaluation.batch import evaluate_batch
from objstate.outputs import WORKSHOP
from objstate.recording.batches import read_logs, result_of, scan_batch
from objstate.recording.index import INDEX, read_outcomes
from objstate.recording.parts import BESIDE
from objstate.recording.results import is_result
from objstate.run import RunOptions, estimate_log
from objstate.statistics import door_statistics
from tests.batch.conftest import COUNT, Drives
from tests.storage import small_files

SLIM = Settings.model_validate({"localization": {"max_particles": 300}})


@pytest.fixture(scope="session")
def by_two(drives: Drives, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A batch of all drives and a log that is none, run by two workers."""
    bad = drives.folder / "broken.mcap"
    bad.write_bytes(b"no log")
    out = tmp_path_factory.mktemp("batch") / "by_two"
    batch(drives, out, workers=2)
    return out


def batch(
    drives: Drives,
    out: Path,
    run: RunOptions | None = None,
    on_event: Callable[[object], None] | None = None,
    **options: object,
) -> tuple[Leftover, dict[str, str]]:
    """Run the drives' folder; what was left to do, and how every log ended."""
    requested = gather(
        [str(drives.folder)], str(drives.building), str(drives.folder), run or RunOptions()
    )
    told: list[Leftover] = []
    result = run_batch(requested, out, BatchOptions(**options), told.append, on_event)
    return told[0], {each.name: each.status for each in result.outcomes}


def asked(drives: Drives, count: int, run: RunOptions | None = None) -> list[Requested]:
    """The first drives, named as in a batch of all."""
    logs = [str(log) for log in drives.logs[:count]]
    return gather(logs, str(drives.building), str(drives.folder), run or RunOptions())


def combined(folder: Path) -> dict[str, bytes]:
    """The combined tables that must not depend on who ran what when."""
    files = [folder / "summary.parquet", *sorted(folder.glob("*.parquet/*"))]
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def test_a_log_that_fails_is_named_and_the_others_are_done(by_two: Path) -> None:
    summary = pl.read_parquet(by_two / "summary.parquet")
    statuses = dict(zip(summary["log"], summary["status"], strict=True))
    assert statuses == {"broken": "failed"} | {f"drive_{n}": "done" for n in range(COUNT)}
    (reason,) = summary.filter(log="broken")["reason"]
    assert "broken.mcap is no log that objstate knows" in reason
    done = summary.filter(status="done")
    assert (done["angle_count"] == 1).all()
    assert (done["robot_error"] < 0.2).all()
    assert (done["scans"] > 10).all()
    timings = pl.read_parquet(by_two / "timings.parquet")
    assert (timings.filter(log="drive_0")["speed"] > 0).all()


def test_every_log_has_the_result_that_estimate_writes(
    drives: Drives, by_two: Path, tmp_path: Path
) -> None:
    estimate_log([drives.logs[0]], drives.building, tmp_path / "alone")
    for name in ("estimates.parquet", "trajectory.tum"):
        assert (by_two / "logs" / "drive_0" / name).read_bytes() == (
            tmp_path / "alone" / name
        ).read_bytes()


@pytest.mark.parametrize(
    ("table", "filtered"), [("estimates.parquet", True), ("smoothed.parquet", False)]
)
def test_the_combined_estimates_are_those_of_all_logs(
    by_two: Path, table: str, filtered: bool
) -> None:
    every = pl.read_parquet(by_two / table)
    assert set(every["log"]) == {f"drive_{n}" for n in range(COUNT)}
    own = pl.read_parquet(by_two / "logs" / "drive_1" / table)
    assert every.filter(log="drive_1").drop("log").equals(own)
    scanned = scan_batch(by_two, filtered=filtered).collect()
    assert scanned.sort("log", "stamp").equals(every.sort("log", "stamp"))


def test_one_worker_makes_the_same_bytes(drives: Drives, by_two: Path, tmp_path: Path) -> None:
    batch(drives, tmp_path / "by_one", workers=1)
    assert combined(tmp_path / "by_one") == combined(by_two)


def test_a_second_start_does_only_what_is_missing(drives: Drives, by_two: Path) -> None:
    before = combined(by_two)
    left, ended = batch(drives, by_two)
    assert left.jobs == ()
    assert (set(left.finished), left.given_up) == ({f"drive_{n}" for n in range(3)}, ("broken",))
    assert ended["broken"] == "failed"
    left, _ = batch(drives, by_two, retry_failed=True)
    assert [job.name for job in left.jobs] == ["broken"]
    assert combined(by_two) == before


def test_other_settings_are_refused_or_make_results_anew(
    drives: Drives, by_two: Path, tmp_path: Path
) -> None:
    before = combined(by_two)
    with pytest.raises(ResultError, match=r"settings\.localization\.max_particles.*--overwrite"):
        batch(drives, by_two, RunOptions(settings=SLIM))
    assert combined(by_two) == before
    shutil.copytree(by_two, tmp_path / "own")
    again = asked(drives, 1, RunOptions(settings=SLIM))
    result = run_batch(again, tmp_path / "own", BatchOptions(overwrite=True))
    assert result.ran == ("drive_0",)


def test_broken_off_it_keeps_what_is_finished_and_goes_on_from_there(
    drives: Drives, by_two: Path, tmp_path: Path
) -> None:
    def interrupt(event: object) -> None:
        if isinstance(event, Ended) and event.outcome.status == "done":
            raise KeyboardInterrupt

    out = tmp_path / "broken_off"
    with pytest.raises(KeyboardInterrupt):
        batch(drives, out, on_event=interrupt, workers=1)
    finished = [log.name for log in read_logs(out) if is_result(result_of(out, log.name))]
    assert len(finished) == 1
    partial = pl.read_parquet(out / "summary.parquet")
    # the largest was run first, the broken one is the smallest
    assert dict(partial["status"].value_counts().rows()) == {"done": 1, "not run": COUNT}
    assert list((out / "logs").glob(".*")) == []
    left, _ = batch(drives, out)
    assert {job.name for job in left.jobs}.isdisjoint(finished)
    assert set(scan_batch(out).collect()["log"]) == {f"drive_{n}" for n in range(COUNT)}
    assert combined(out) == combined(by_two)


def test_results_that_are_made_anew_stay_until_there_are_new_ones(
    drives: Drives, by_two: Path, tmp_path: Path
) -> None:
    shutil.copytree(by_two, tmp_path / "out")
    before = combined(tmp_path / "out")

    def interrupt(event: object) -> None:
        if isinstance(event, Progressed):
            raise KeyboardInterrupt

    slim = asked(drives, 2, RunOptions(settings=SLIM))
    anew = BatchOptions(overwrite=True, workers=1)
    with pytest.raises(KeyboardInterrupt):
        run_batch(slim, tmp_path / "out", anew, on_event=interrupt)
    assert combined(tmp_path / "out") == before
    assert len(run_batch(slim, tmp_path / "out", anew).ran) == 2
    assert combined(tmp_path / "out") != before


def test_an_old_result_does_not_count_for_a_log_that_now_fails(
    drives: Drives, tmp_path: Path
) -> None:
    log = tmp_path / "drive.mcap"
    log.write_bytes(drives.logs[0].read_bytes())
    requested = gather([str(log)], str(drives.building), None, RunOptions())
    assert run_batch(requested, tmp_path / "out").failed == []
    log.write_bytes(b"no log any more")
    (failed,) = run_batch(requested, tmp_path / "out").failed
    assert failed.status == "failed"
    assert pl.read_parquet(tmp_path / "out" / "summary.parquet")["scans"].to_list() == [None]
    assert is_result(result_of(tmp_path / "out", "drive"))


def test_a_full_disk_leaves_logs_to_be_run_later(drives: Drives, tmp_path: Path) -> None:
    requested = asked(drives, COUNT)
    out = tmp_path / "out"
    with (
        ExitStack() as disk,
        pytest.raises(OutageError, match=r"Can't write .*3 logs were not run"),
    ):
        run_batch(
            requested,
            out,
            BatchOptions(workers=2),
            lambda _: disk.enter_context(small_files(3000)),
        )
    assert [each.status for each in read_outcomes(out, read_logs(out)).values()] == [
        "not run"
    ] * COUNT
    assert list((out / "logs").iterdir()) == []
    result = run_batch(requested, out)
    assert (len(result.ran), result.failed) == (COUNT, [])


def test_a_batch_that_is_killed_as_it_starts_is_a_batch_still(
    drives: Drives, by_two: Path, tmp_path: Path
) -> None:
    shutil.copytree(by_two, tmp_path / "out")
    requested = asked(drives, 1)
    before = (tmp_path / "out" / "batch.json").read_text()
    workshop = tmp_path / "out" / f"{WORKSHOP}0000"
    (workshop / "new").mkdir(parents=True)
    (workshop / "new" / "batch.json").write_text("{")
    (workshop / "lock").touch()
    assert run_batch(requested, tmp_path / "out").ran == ()
    assert (tmp_path / "out" / "batch.json").read_text() == before
    assert not workshop.exists()


def test_a_folder_of_somebody_elses_is_refused(drives: Drives, tmp_path: Path) -> None:
    (tmp_path / "own.txt").write_text("mine")
    with pytest.raises(ResultError, match="no batch"):
        batch(drives, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["own.txt"]


def test_a_start_pose_of_a_row_is_used(drives: Drives, tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text(f'log,initial_pose\n{drives.logs[0]},"500000,0,0"\n')
    requested = gather([str(tmp_path / "rows.csv")], str(drives.building), None, RunOptions())
    result = run_batch(requested, tmp_path / "out", BatchOptions())
    (outcome,) = result.failed
    assert "away from the building" in (outcome.reason or "")


def test_a_log_elsewhere_is_fetched(drives: Drives, tmp_path: Path) -> None:
    address = f"file://{drives.logs[0]}"
    copy = fetched(address, tmp_path)
    assert copy.read_bytes() == drives.logs[0].read_bytes()
    assert size_of(address) == size_of(str(drives.logs[0])) == len(copy.read_bytes())


def test_what_workers_left_beside_results_is_what_the_results_tell(
    by_two: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(by_two, bare)
    for file in (bare / INDEX, *bare.glob(f"logs/*/{BESIDE}")):
        file.unlink()
    figures = evaluate_batch(bare), door_statistics(bare)

    def fail(*_: object, **__: object) -> bytes:
        raise AssertionError("a result was read again")

    again = evaluate_batch(bare), door_statistics(bare)
    monkeypatch.setattr("objstate.evaluation.batch.judged_sums", fail)
    monkeypatch.setattr("objstate.statistics.looks.looks_of", fail)
    assert (evaluate_batch(by_two), door_statistics(by_two)) == figures == again
    assert evaluate_batch(bare, against=by_two).against[0].difference == 0.0
    (by_two / "logs" / "drive_0" / BESIDE).write_bytes(b"damaged")
    (by_two / INDEX).unlink()
    with pytest.raises(AssertionError, match="read again"):
        evaluate_batch(by_two)
