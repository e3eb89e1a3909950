"""A URL means logs as a path does: a folder of them is many drives."""

from pathlib import Path

import pytest

from objstate.batch import gather
from objstate.batch.addresses import fetched, find_logs, size_of
from objstate.conversion import convert
from objstate.errors import LogError, ObjstateError, OutageError
from objstate.run import RunOptions
from tests.batch.conftest import Drives
from tests.batch.test_cluster import served

fsspec = pytest.importorskip("fsspec")


@pytest.fixture(scope="module")
def fleet(drives: Drives, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of several formats at several depths, beside other files."""
    home = tmp_path_factory.mktemp("fleet")
    (home / "monday").mkdir()
    (home / "monday" / "log.mcap").write_bytes(drives.logs[0].read_bytes())
    convert(drives.logs[1], home / "tuesday" / "bag", format="rosbag2")
    convert(drives.logs[1], home / "tuesday" / "carmen.log")
    (home / "notes.txt").write_text("not a log")
    (home / "truth.csv").write_text("stamp,object,coordinate,value\n")
    return home


LOGS = ["monday/log.mcap", "tuesday/bag", "tuesday/carmen.log"]


def test_a_prefix_of_a_bucket_is_a_folder_of_logs(fleet: Path) -> None:
    fsspec.filesystem("memory").put(str(fleet), "/bucket/fleet", recursive=True)
    for prefix in ("memory://bucket/fleet", "memory://bucket/fleet/", "memory://bucket/*"):
        found = find_logs(prefix)
        assert found == [f"memory:///bucket/fleet/{name}" for name in LOGS]
    assert find_logs(str(fleet)) == [str(fleet / name) for name in LOGS]


def test_parts_of_a_bag_whose_metadata_is_missing_are_one_log(tmp_path: Path) -> None:
    for name in ("run/run_0.mcap", "run/run_10.mcap", "day/run_0.mcap", "day/run_1.mcap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("nothing")
    logs = ["day/run_0.mcap", "day/run_1.mcap", "run"]
    assert find_logs(str(tmp_path)) == [str(tmp_path / name) for name in logs]
    assert find_logs(str(tmp_path / "run")) == [str(tmp_path / "run")]
    fsspec.filesystem("memory").put(str(tmp_path), "/bucket/killed", recursive=True)
    assert find_logs("memory://bucket/killed") == [f"memory:///bucket/killed/{n}" for n in logs]
    (tmp_path / "run" / "other.mcap").write_text("nothing")
    assert len(find_logs(str(tmp_path / "run"))) == 3


def test_a_page_of_links_is_a_folder_of_logs(fleet: Path) -> None:
    pytest.importorskip("aiohttp")
    with served(fleet) as address:
        assert find_logs(address) == [f"{address}/{name}" for name in LOGS]
        assert find_logs(f"{address}/monday/log.mcap") == [f"{address}/monday/log.mcap"]


def test_what_is_not_there_is_named() -> None:
    with pytest.raises(LogError, match="there is nothing"):
        find_logs("memory://bucket/none")
    with pytest.raises(LogError, match="none"):
        size_of("memory://bucket/none.mcap")


def test_a_server_that_does_not_answer_is_no_fault_of_a_log(tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    with pytest.raises(OutageError, match="ConnectionRefused") as told:
        fetched("http://127.0.0.1:9/drive.mcap", tmp_path)
    assert told.value.transient


def test_a_folder_is_never_read_as_one_drive(fleet: Path, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="name each log"):
        fetched(f"file://{fleet}", tmp_path)
    (tmp_path / "manifest.csv").write_text(f"log\n{fleet}\n")
    with pytest.raises(LogError, match=r"row 1: .* name each log"):
        gather([str(tmp_path / "manifest.csv")], "/house.urdf", None, RunOptions())


def test_a_truth_that_is_missing_is_refused_at_once(drives: Drives) -> None:
    with pytest.raises(ObjstateError, match=r"no file /no/such/truth\.csv"):
        gather([str(drives.logs[0])], "/house.urdf", "/no/such/truth.csv", RunOptions())


@pytest.mark.parametrize("column", ["truth", "path", "settings"])
def test_what_a_manifest_names_is_fetched_from_anywhere(tmp_path: Path, column: str) -> None:
    missing = tmp_path.as_uri() + "/missing"
    (tmp_path / "manifest.csv").write_text(f"log,{column}\na.mcap,{missing}\n")
    with pytest.raises(ObjstateError, match="missing"):
        gather([str(tmp_path / "manifest.csv")], "/house.urdf", None, RunOptions())
