"""The index of a batch agrees with the folder, whatever was killed, removed or made without it."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from objstate.errors import OutageError, ResultError
from objstate.recording.batches import BatchLog, Outcome, result_of
from objstate.recording.index import INDEX, Entry, open_index, read_outcomes, settled
from objstate.recording.results import MARK
from objstate.recording.summary import write_summary
from tests.storage import small_files

NAMES = ("a", "b", "c")
LOGS = [BatchLog(name, f"/{name}.mcap", "/room.urdf") for name in NAMES]
MADE = {"options": {"seed": 0}, "inputs": {"building": {"geometry_sha256": "x"}, "logs": []}}


def finish(folder: Path, name: str, size: int = 7, when_ns: int = 10**18) -> None:
    """A result as far as the index looks at it."""
    result = result_of(folder, name)
    result.mkdir(parents=True, exist_ok=True)
    inputs = MADE["inputs"] | {"logs": [{"bytes": size}]}
    write_summary(result, MADE | {"inputs": inputs})
    (result / MARK).touch()
    os.utime(result / MARK, ns=(when_ns, when_ns))


def statuses(folder: Path) -> dict[str, str]:
    return {name: outcome.status for name, outcome in read_outcomes(folder, LOGS).items()}


STEPS = st.lists(
    st.tuples(st.sampled_from(["finish", "fail", "forget", "remove", "look"]),
              st.sampled_from(NAMES)),
    max_size=12,
)  # fmt: skip


@given(STEPS)
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_what_is_told_is_what_lies_there(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, str]]
) -> None:
    """By whatever way, and however often the index was asked meanwhile."""
    folder = tmp_path_factory.mktemp("batch")
    expected = dict.fromkeys(NAMES, "not run")
    there: set[str] = set()
    for number, (step, name) in enumerate(steps):
        with open_index(folder) as index:
            if step == "finish":
                finish(folder, name, when_ns=10**18 + number)
                index.note([Outcome(name, "done", attempts=1)])
                there.add(name)
                expected[name] = "done"
            elif step == "fail":
                index.note([Outcome(name, "failed", "it is no log")])
                expected[name] = "failed"
            elif step == "forget":
                index.forget([name])
                if expected[name] != "not run" or name in there:
                    expected[name] = "done" if name in there else "not run"
            elif step == "remove" and name in there:
                (result_of(folder, name) / MARK).unlink()
                there.remove(name)
                expected[name] = "failed" if expected[name] == "failed" else "not run"
            else:
                settled(index, folder, LOGS)
    assert statuses(folder) == expected


def test_without_an_index_results_and_notes_are_read_once(tmp_path: Path) -> None:
    finish(tmp_path, "a", size=5)
    finish(tmp_path, "b")
    (tmp_path / "outcomes").mkdir()
    for outcome in (Outcome("a", "done", None, 2, 99.0), Outcome("b", "killed", "thrice", 3)):
        text = json.dumps(asdict(outcome))
        (tmp_path / "outcomes" / f"{outcome.name}.json").write_text(text)
    assert statuses(tmp_path) == {"a": "done", "b": "killed", "c": "not run"}
    with open_index(tmp_path) as index:
        entry = index.entries()["a"]
        assert entry.outcome == Outcome("a", "done", None, 2, 99.0)
        assert entry.making is not None
        assert (entry.making.bytes, entry.making.geometry) == (5, "x")
        (result_of(tmp_path, "a") / "run.json").unlink()
        assert settled(index, tmp_path, LOGS)["a"] == entry  # without another look at the result


def test_a_newer_result_counts_instead(tmp_path: Path) -> None:
    finish(tmp_path, "a", size=5)
    statuses(tmp_path)
    finish(tmp_path, "a", size=6, when_ns=2 * 10**18)
    with open_index(tmp_path) as index:
        making = settled(index, tmp_path, LOGS)["a"].making
    assert making is not None
    assert making.bytes == 6


def test_killed_in_a_change_it_is_as_before(tmp_path: Path) -> None:
    finish(tmp_path, "a")
    before = statuses(tmp_path)
    code = (
        "import os, signal, sys\n"
        "from objstate.recording.batches import Outcome\n"
        "from objstate.recording.index import open_index\n"
        "with open_index(sys.argv[1]) as index, index.changing() as connection:\n"
        "    connection.execute('PRAGMA cache_size = 1')\n"
        "    connection.execute('DELETE FROM log')\n"
        "    connection.executemany('INSERT INTO log (name, status, reason) VALUES (?, ?, ?)',\n"
        "        [(str(n), 'failed', 'x' * 500) for n in range(500)])\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert statuses(tmp_path) == before


def test_a_full_disk_leaves_it_as_it_was(tmp_path: Path) -> None:
    finish(tmp_path, "a")
    before = statuses(tmp_path)
    size = (tmp_path / INDEX).stat().st_size
    many = {f"n{n}": Entry(Outcome(f"n{n}", "failed", "x" * 500)) for n in range(200)}
    with open_index(tmp_path) as index:
        with small_files(size + 5000), pytest.raises(OutageError, match=INDEX):
            index.describe(many)
        assert set(index.entries()) == set(NAMES)
    assert statuses(tmp_path) == before


def test_a_damaged_index_names_the_cure(tmp_path: Path) -> None:
    (tmp_path / INDEX).write_bytes(b"no index at all" * 100)
    with pytest.raises(ResultError, match="remove it"):
        statuses(tmp_path)


def test_what_was_replaced_gives_back_its_room(tmp_path: Path) -> None:
    with open_index(tmp_path) as index:
        index.keep("sums", [(str(n), "1", bytes(4000)) for n in range(100)])
        large = (tmp_path / INDEX).stat().st_size
        index.keep("sums", [(str(n), "2", b"") for n in range(100)])
        index.compact()
        assert (tmp_path / INDEX).stat().st_size < large / 4
        assert set(index.stamps("sums").values()) == {"2"}
