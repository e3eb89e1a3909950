"""A result, and a batch, for all tests of reports."""

import shutil
from pathlib import Path

import pytest

from objstate.batch.combine import combine
from objstate.recording.batches import BatchLog, Outcome, result_of, write_logs
from objstate.recording.index import write_outcome
from tests.report.pages import make_result


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_result(tmp_path_factory.mktemp("reported"))


@pytest.fixture
def batch(result: Path, tmp_path: Path) -> Path:
    """Two logs that are done, alike, one with truth; one that failed."""
    folder, drive = tmp_path / "batch", result.parent
    urdf, log = str(drive / "room.urdf"), str(drive / "log" / "log.mcap")
    truth, path = str(drive / "log" / "truth.csv"), str(drive / "log" / "path.tum")
    logs = [
        BatchLog("first", log, urdf, truth, path),
        BatchLog("second", log, urdf),
        BatchLog("broken", str(drive / "<broken>.mcap"), urdf),
    ]
    for name in ("first", "second"):
        result_of(folder, name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(result, result_of(folder, name))
        (result_of(folder, name) / "report.html").unlink(missing_ok=True)
        write_outcome(folder, Outcome(name, "done", attempts=1))
    write_outcome(folder, Outcome("broken", "failed", "It is <no> log.", attempts=1))
    write_logs(folder, logs)
    combine(folder)
    return folder
