"""Worker processes that fail, hang and die cost only the log they were at."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pytest

from objstate.batch.events import Began, Ended, Progressed
from objstate.batch.pool import run_here
from objstate.errors import OutageError
from objstate.recording.batches import Outcome
from tests.batch.antics import Antic, play

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


def outcomes(folder: Path, names: Sequence[str], workers: int, limit: float) -> dict[str, Outcome]:
    events = run_here(play, folder, [Antic(name) for name in names], workers, limit)
    return {event.outcome.name: event.outcome for event in events if isinstance(event, Ended)}


def test_every_log_ends_as_it_should_whatever_the_others_do(tmp_path: Path) -> None:
    names = ["good1", "fails", "crashes", "good2", "hangs", "stumbles", "errs", "good3"]
    ended = outcomes(tmp_path, names, workers=2, limit=12.0)
    assert {name: ended[name].status for name in names} == {
        "good1": "done", "good2": "done", "good3": "done", "stumbles": "done",
        "fails": "failed", "errs": "failed", "crashes": "killed", "hangs": "timed out",
    }  # fmt: skip
    assert ended["fails"].reason == "the log is no log"
    assert "ZeroDivisionError" in (ended["errs"].reason or "")
    assert "12 s" in (ended["hangs"].reason or "")
    assert (ended["stumbles"].attempts, ended["crashes"].attempts) == (3, 3)
    assert (tmp_path / "crashes.begun").stat().st_size == 3
    assert {path.stem for path in tmp_path.glob("*.done")} == {
        "good1",
        "good2",
        "good3",
        "stumbles",
    }


def test_a_full_disk_is_no_fault_of_a_log(tmp_path: Path) -> None:
    before = children(os.getpid())
    with pytest.raises(OutageError, match="No space left on device; free some space"):
        outcomes(tmp_path, ["good1", "meets a full disk", "hangs"], workers=2, limit=60.0)
    assert children(os.getpid()) == before


def test_what_passes_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("objstate.batch.attempts.PAUSE", 0.1)
    ended = outcomes(tmp_path, ["loses the network"], workers=1, limit=60.0)
    outcome = ended["loses the network"]
    assert (outcome.status, outcome.attempts) == ("done", 3)
    with pytest.raises(OutageError, match="Stale file handle"):
        outcomes(tmp_path, ["never has a network"], workers=1, limit=60.0)


def test_a_worker_has_one_thread_for_each_library(tmp_path: Path) -> None:
    outcomes(tmp_path, ["tells threads"], workers=1, limit=60)
    assert (tmp_path / "threads").read_text() == "1"


def test_what_happens_is_told_in_order(tmp_path: Path) -> None:
    (tmp_path / "context").mkdir()
    events = list(run_here(play, tmp_path, [Antic("good")], 1, None))
    assert [type(event) for event in events] == [Began, Progressed, Ended]


def test_broken_off_no_worker_goes_on(tmp_path: Path) -> None:
    before = children(os.getpid())
    with closing(run_here(play, tmp_path, [Antic("hangs1"), Antic("hangs2")], 2, None)) as events:
        began = [next(events) for _ in range(4)]
    assert {type(event) for event in began} == {Began, Progressed}
    assert children(os.getpid()) == before


def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    script = (
        "import sys, pathlib; from objstate.batch.pool import run_here; "
        "from tests.batch.antics import Antic, play; "
        "list(run_here(play, pathlib.Path(sys.argv[1]), [Antic('hangs')], 1, None))"
    )
    parent = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], cwd=ROOT)
    until((tmp_path / "hangs.begun").exists)
    (worker,) = children(parent.pid)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    until(lambda: not Path(f"/proc/{worker}/cmdline").exists())


def children(parent: int) -> list[int]:
    """Living child processes."""
    listed = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for file in listed for pid in file.read_text().split()]


def until(condition, seconds: float = 30.0) -> None:
    """Wait for what must come; fail if it doesn't."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)
