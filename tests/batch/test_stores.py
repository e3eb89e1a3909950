"""A batch whose inputs and results lie in a store: the same figures, whatever is dropped or killed."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from objstate import storage
from objstate.batch import BatchOptions, Ended, gather, run_batch
from objstate.errors import OutageError
from objstate.evaluation.batch import evaluate_batch
from objstate.recording.batches import read_summary_table
from objstate.recording.mirror import WORDS, mirrored
from objstate.report import write_batch_report
from objstate.run import RunOptions
from objstate.statistics import door_statistics
from tests.batch.conftest import COUNT, Drives

fsspec = pytest.importorskip("fsspec")
COLUMNS = ["log", "status", "scans", "estimates", "angle_count", "angle_error", "robot_error"]


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """The address of an S3 server."""
    pytest.importorskip("s3fs")
    moto = pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    yield f"http://{host}:{port}"
    server.stop()


@pytest.fixture
def bucket(server: str, drives: Drives, monkeypatch: pytest.MonkeyPatch) -> str:
    """A bucket with the drives, their truths, the building and a manifest."""
    settings = {"AWS_ENDPOINT_URL": server, "AWS_ACCESS_KEY_ID": "test",
                "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1"}  # fmt: skip
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    files = fsspec.filesystem("s3")
    if not files.exists("fleet"):
        files.mkdir("fleet")
        for file in (*drives.folder.glob("drive_*/*"), drives.building):
            where = file.relative_to(drives.folder.parent).as_posix()
            files.put_file(str(file), f"fleet/{where}")
        rows = ["log,truth"] + [f"drive_{n}/log.mcap,drive_{n}/truth.csv" for n in range(COUNT)]
        files.pipe_file("fleet/drives/manifest.csv", "\n".join(rows).encode())
    return "s3://fleet"


def figures(folder: Path) -> tuple[Any, ...]:
    table = read_summary_table(folder).select(COLUMNS).rows()
    return table, evaluate_batch(folder).overall, door_statistics(folder)


def test_from_a_store_into_a_store_the_figures_are_those_of_folders(
    bucket: str, drives: Drives, tmp_path: Path
) -> None:
    logs = [str(log) for log in drives.logs]
    here = gather(logs, str(drives.building), str(drives.folder), RunOptions())
    run_batch(here, tmp_path / "out")
    there = gather([f"{bucket}/drives"], f"{bucket}/room.urdf", f"{bucket}/drives", RunOptions())
    assert [each.log.log for each in there] == [
        f"{bucket}/drives/drive_{n}/log.mcap" for n in range(COUNT)
    ]
    result = run_batch(there, f"{bucket}/out", BatchOptions(workers=2))
    assert result.failed == []
    with mirrored(f"{bucket}/out") as mirror:
        assert figures(mirror) == figures(tmp_path / "out")
        assert write_batch_report(mirror).stat().st_size > 10_000
    assert storage.listed(f"{bucket}/out/{WORDS}") == []
    assert storage.exists(f"{bucket}/out/report.html")
    assert run_batch(there, f"{bucket}/out").ran == ()


def test_killed_before_the_index_was_sent_nothing_is_run_again(bucket: str) -> None:
    asked = gather([f"{bucket}/drives/manifest.csv"], f"{bucket}/room.urdf", None, RunOptions())
    assert all(each.log.truth for each in asked)

    def die(event: object) -> None:
        if isinstance(event, Ended):
            raise SystemExit

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("objstate.recording.mirror.Mirror.send", lambda *_: None)  # as after kill -9
        with pytest.raises(SystemExit):
            run_batch(asked, f"{bucket}/killed", BatchOptions(workers=1), None, die)
    finished = storage.listed(f"{bucket}/killed/{WORDS}")
    assert len(finished) >= 1
    result = run_batch(asked, f"{bucket}/killed")
    assert set(result.ran).isdisjoint(finished)
    assert [outcome.status for outcome in result.outcomes] == ["done"] * COUNT


class Dropping:
    """What a storage does, but some requests are dropped."""

    def __init__(self, do: Callable[[], object], drops: int) -> None:
        self._do, self.left = do, drops

    def __call__(self) -> object:
        if self.left:
            self.left -= 1
            raise ConnectionResetError("dropped")
        return self._do()


@pytest.mark.parametrize("drops", range(storage.ATTEMPTS))
def test_requests_that_are_dropped_are_made_again(
    drops: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(storage, "PAUSE", 0.0)
    assert storage.retried(Dropping(lambda: 7, drops), "Can't reach it") == 7


def test_a_storage_that_drops_all_is_an_outage(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(storage, "PAUSE", 0.0)
    dropping = Dropping(lambda: 7, storage.ATTEMPTS + 5)
    with pytest.raises(OutageError, match=r"Can't reach it.*dropped") as told:
        storage.retried(dropping, "Can't reach it")
    assert told.value.transient
    assert dropping.left == 5


def test_a_building_brings_its_meshes_and_its_sidecar_but_nothing_from_above(
    tmp_path: Path,
) -> None:
    files = fsspec.filesystem("memory")
    text = '<robot><mesh filename="meshes/a.stl"/><mesh filename="../../secret.stl"/></robot>'
    files.pipe_file("/models/b.urdf", text.encode())
    files.pipe_file("/models/meshes/a.stl", b"solid")
    files.pipe_file("/models/b.building.yaml", b"{}")
    files.pipe_file("/secret.stl", b"no")
    path = storage.building_here("memory://models/b.urdf")
    assert path.read_text() == text
    assert (path.parent / "meshes" / "a.stl").read_bytes() == b"solid"
    assert (path.parent / "b.building.yaml").exists()
    assert not (path.parent / "../../secret.stl").resolve().exists()
