"""On a real Dask scheduler with real workers, of which one is killed in mid-run."""

import functools
import http.server
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from objstate.batch import BatchOptions, Progressed, gather, run_batch
from objstate.batch.cluster import run_on_cluster
from objstate.batch.events import Ended
from objstate.batch.jobs import Job
from objstate.errors import OutageError, SettingsError
from objstate.recording.batches import read_logs
from objstate.recording.index import read_outcomes
from objstate.recording.summary import read_summary
from objstate.run import RunOptions
from tests.batch.antics import play
from tests.batch.conftest import Drives
from tests.batch.test_batch import combined

ROOT = Path(__file__).parents[2]
WORKERS = 2


class Cluster:
    """A scheduler and its workers, as processes."""

    def __init__(self, folder: Path, workers: int = WORKERS) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        self._folder = folder
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(port))
        self.workers = [self.worker() for _ in range(workers)]

    def worker(self) -> "subprocess.Popen[bytes]":
        options = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self._folder))
        return self._start("worker", self.address, *options)

    def _start(self, *words: str) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        return subprocess.Popen(
            command, cwd=self._folder, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    pytest.importorskip("distributed")
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    yield cluster
    cluster.end()


def test_the_same_bytes_as_here_though_a_worker_is_killed(
    drives: Drives, cluster: Cluster, tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill_one(event: object) -> None:
        if isinstance(event, Progressed) and not killed:
            victim = cluster.workers.pop(0)
            victim.send_signal(signal.SIGKILL)
            killed.append(victim.wait())
            cluster.workers.append(cluster.worker())

    requested = gather(
        [str(log) for log in drives.logs], str(drives.building), str(drives.folder), RunOptions()
    )
    here = run_batch(requested, tmp_path / "here", BatchOptions())
    there = run_batch(
        requested, tmp_path / "there", BatchOptions(scheduler=cluster.address), None, kill_one
    )
    assert killed == [-signal.SIGKILL]
    assert here.failed == there.failed == []
    assert combined(tmp_path / "there") == combined(tmp_path / "here")


def test_logs_are_read_where_the_worker_runs(
    drives: Drives, cluster: Cluster, tmp_path: Path
) -> None:
    pytest.importorskip("aiohttp")
    with served(drives.folder) as address:
        url = f"{address}/drive_0/log.mcap"
        requested = gather([url], str(drives.building), str(drives.folder), RunOptions())
        result = run_batch(requested, tmp_path / "out", BatchOptions(scheduler=cluster.address))
    assert result.failed == []
    (outcome,) = result.outcomes
    run = read_summary(tmp_path / "out" / "logs" / outcome.name)
    assert [file["path"] for file in run["inputs"]["logs"]] == [url]
    assert run["inputs"]["logs"][0]["bytes"] == drives.logs[0].stat().st_size


def test_a_log_that_kills_three_workers_is_set_aside(cluster: Cluster, tmp_path: Path) -> None:
    names = ("crashes", "stumbles", "hangs", "fails")
    jobs = [Job(name, "", "", 0, str(tmp_path / name)) for name in names]
    events = run_on_cluster(play, tmp_path, jobs, cluster.address, 3.0)
    ended = {event.outcome.name: event.outcome for event in events if isinstance(event, Ended)}
    assert ended["crashes"].status == "killed"
    assert (tmp_path / "crashes.begun").stat().st_size == 3
    assert (ended["stumbles"].status, ended["stumbles"].attempts) == ("done", 3)
    assert ended["hangs"].status == "timed out"
    assert ended["fails"].reason == "the log is no log"


def test_a_log_that_straggles_is_run_once_more_by_a_worker_that_idles(
    cluster: Cluster, tmp_path: Path
) -> None:
    jobs = [Job(name, "", "", 0, str(tmp_path / name)) for name in ("straggles", "a", "b", "c")]
    events = run_on_cluster(play, tmp_path, jobs, cluster.address, 120.0)
    ended = [event.outcome for event in events if isinstance(event, Ended)]
    assert {outcome.name: outcome.status for outcome in ended} == dict.fromkeys(
        ("a", "b", "c", "straggles"), "done"
    )
    assert ended[-1].name == "straggles"
    assert (tmp_path / "straggles.begun").stat().st_size == 2


def test_ctrl_c_ends_a_batch_that_waits_for_workers(drives: Drives, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    lonely = Cluster(tmp_path, workers=0)
    manifest = tmp_path / "manifest.csv"  # whose reading imports polars
    manifest.write_text(f"log\n{drives.logs[0]}\n")
    words = ("--building", drives.building, "--out", tmp_path / "out", "--scheduler")
    command = ["batch", manifest, *words, lonely.address]
    process = subprocess.Popen(
        [sys.executable, str(ROOT / "cli.py"), *map(str, command)],
        stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        assert process.stderr is not None
        while "Waiting for workers" not in process.stderr.readline():
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=10)
        assert process.returncode == 130
    finally:
        process.kill()
        lonely.end()


def test_logs_are_not_run_where_the_scheduler_goes_away(drives: Drives, tmp_path: Path) -> None:
    dask = pytest.importorskip("dask")
    own = Cluster(tmp_path, workers=1)
    ended: list[str] = []

    def kill_it(event: object) -> None:
        if isinstance(event, Ended):
            ended.append(event.outcome.name)
        if isinstance(event, Ended) and len(ended) == 1:
            dask.config.set({"distributed.comm.timeouts.connect": "2s"})  # of looking for it again
            own.scheduler.kill()

    logs = [str(log) for log in drives.logs]
    requested = gather(logs, str(drives.building), None, RunOptions())
    try:
        with (
            dask.config.set({"distributed.comm.timeouts.connect": "30s"}),
            pytest.raises(OutageError, match=r"scheduler .* went away; .* not run"),
        ):
            run_batch(
                requested, tmp_path / "out", BatchOptions(scheduler=own.address), None, kill_it
            )
    finally:
        own.end()
    statuses = {
        name: outcome.status
        for name, outcome in read_outcomes(tmp_path / "out", read_logs(tmp_path / "out")).items()
    }
    assert {statuses.pop(name) for name in ended} == {"done"}
    assert set(statuses.values()) == {"not run"}


def names(batch: Path) -> list[str]:
    return [log.name for log in read_logs(batch)]


def test_where_no_scheduler_is_the_cure_is_named(
    drives: Drives, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dask = pytest.importorskip("dask")
    requested = gather([str(drives.logs[0])], str(drives.building), None, RunOptions())
    with dask.config.set({"distributed.comm.timeouts.connect": "0.5s"}):
        with pytest.raises(SettingsError, match="dask scheduler"):
            run_batch(requested, tmp_path / "out", BatchOptions(scheduler="tcp://127.0.0.1:9"))
        with pytest.raises(SettingsError, match="dask scheduler"):
            run_batch(requested, tmp_path / "out", BatchOptions(scheduler="none.json"))


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The folder over HTTP."""
    handler = functools.partial(Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        pass
