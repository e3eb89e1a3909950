"""Outputs are there whole or not at all, whenever their process is killed, and on full disks."""

from __future__ import annotations

import ast
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import objstate
from objstate.errors import ResultError, StorageError
from objstate.outputs import WORKSHOP, claimed, sweep, whole, write_text
from objstate.recording.logs import FORMATS, open_log_writer
from objstate.simulation.messages import ODOMETRY, odometry_message
from tests.storage import small_files

PACKAGE = Path(objstate.__file__).parent

# Writes over and over, and each time is killed one file operation later than before.
KILLED = """
import os, shutil, sys
from pathlib import Path
import objstate.outputs as outputs

home, kind, exchanges = Path(sys.argv[1]), sys.argv[2], sys.argv[3] == "exchanges"
if not exchanges:
    outputs._exchange = lambda one, other: False
    left_over = 1  # a storage that can't exchange folders: the next output puts the old one back
else:
    left_over = 0

def content(target):
    if kind == "file":
        return target.read_text() if target.exists() else None
    if not target.exists():
        return None
    return "".join(sorted(each.read_text() for each in target.iterdir()))

def make(text):
    any_kind = lambda path: True
    with (
        outputs.claimed(home / "out"),
        outputs.whole(home / "out", overwrite=True, replaceable=any_kind) as made,
    ):
        if kind == "file":
            made.write_text(text * 2)
        else:
            made.mkdir()
            (made / "a").write_text(text)
            (made / "b").write_text(text)

def killing(after):
    left = [after]
    def hook(event, arguments):
        if event.split(".")[0] in ("os", "open", "shutil", "ctypes", "fcntl"):
            left[0] -= 1
            if left[0] < 0:
                os._exit(9)
    sys.addaudithook(hook)

make("old")
deaths, missing = 0, 0
while True:
    child = os.fork()
    if child == 0:
        killing(deaths)
        make("new")
        os._exit(0)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0:
        break
    found = content(home / "out")
    missing += found is None
    assert found in (None, "oldold", "newnew"), (deaths, found)
    outputs.sweep(home)
    assert content(home / "out") in ("oldold", "newnew"), deaths
    make("old")
    assert os.listdir(home) == ["out"], (deaths, os.listdir(home))
    deaths += 1
assert content(home / "out") == "newnew"
assert missing <= left_over, missing
print(deaths)
"""


@pytest.mark.parametrize("exchanges", ["exchanges", "renames"])
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_whenever_it_is_killed_the_old_or_the_new_is_there(
    tmp_path: Path, kind: str, exchanges: str
) -> None:
    (tmp_path / "home").mkdir()
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path / "home"), kind, exchanges], check=False,
        capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)},
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert int(ended.stdout) > 10  # deaths


def test_what_a_living_process_makes_is_not_swept(tmp_path: Path) -> None:
    with whole(tmp_path / "out") as made:
        sweep(tmp_path)
        write_text(tmp_path / "other", "beside it")
        made.write_text("new")
    assert (tmp_path / "out").read_text() == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "out"]


def test_an_output_is_made_by_one_at_a_time(tmp_path: Path) -> None:
    with claimed(tmp_path / "out"):
        sweep(tmp_path)
        with claimed(tmp_path / "other"):
            pass
        with pytest.raises(ResultError, match=r"Another process is writing .*out now; wait until"):
            claimed(tmp_path / "out").__enter__()
    with claimed(tmp_path / "out"):
        pass
    assert not list(tmp_path.iterdir())


def test_folders_of_somebody_else_are_not_swept(tmp_path: Path) -> None:
    own = tmp_path / f"{WORKSHOP}thesis"
    own.mkdir()
    (own / "chapter.tex").write_text("years of work")
    write_text(tmp_path / "out", "x")
    assert (own / "chapter.tex").exists()


def test_a_file_system_that_makes_no_folders_is_an_error() -> None:
    place = Path("/proc")  # a folder that exists, where making one fails as if it didn't
    with pytest.raises(StorageError, match=r"Can't write /proc.*choose another place"):
        write_text(place / "out", "x")


@pytest.mark.parametrize("writer", ["text", "polars", *FORMATS])
def test_a_full_disk_is_told_alike_whoever_writes(tmp_path: Path, writer: str) -> None:
    target = tmp_path / "out"

    def write() -> None:
        if writer == "text":
            write_text(target, "x" * 10_000)
        elif writer == "polars":
            with whole(target) as file:
                pl.DataFrame({"a": os.urandom(10_000)}).write_parquet(file)
        else:
            with open_log_writer(target, writer) as log:
                for number in range(2000):
                    log.write("/odom", *odometry(number))

    with small_files(1000), pytest.raises(StorageError, match=rf"^Can't write {target}: ") as told:
        write()
    assert WORKSHOP not in str(told.value)
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_told_wherever_in_a_table_it_is_met(tmp_path: Path) -> None:
    frame = pl.DataFrame({"a": ["text"] * 20, "b": list(range(20))})
    frame.write_parquet(tmp_path / "alone")

    def write() -> None:
        with whole(tmp_path / "out") as file:
            frame.write_parquet(file)

    for most in range(0, (tmp_path / "alone").stat().st_size, 40):
        with small_files(most), pytest.raises(StorageError, match="File too large"):
            write()


def odometry(number: int) -> tuple[str, int, object]:
    stamp = 10**18 + number * 10**7
    pose = np.random.default_rng(number).normal(size=3)
    return ODOMETRY, stamp, odometry_message(stamp, pose, np.zeros(3))


def test_an_older_file_outlives_a_full_disk(tmp_path: Path) -> None:
    write_text(tmp_path / "out", "old")
    with small_files(1000), pytest.raises(StorageError):
        write_text(tmp_path / "out", "x" * 10_000)
    assert (tmp_path / "out").read_text() == "old"


def test_a_file_takes_the_place_of_a_folder_and_a_folder_that_of_a_file(tmp_path: Path) -> None:
    def anything(path: Path) -> bool:
        return path.exists()

    write_text(tmp_path / "out", "file")
    with whole(tmp_path / "out", overwrite=True, replaceable=anything) as made:
        made.mkdir()
    assert (tmp_path / "out").is_dir()
    with whole(tmp_path / "out", overwrite=True, replaceable=anything) as made:
        made.write_text("file")
    assert (tmp_path / "out").read_text() == "file"


def test_pipes_and_links_are_written_to_and_stay(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"
    write_text("/dev/null", "gone")


@pytest.mark.parametrize("url", ["s3://bucket/out", Path("s3://bucket/out"), "file:///tmp/out"])
def test_a_url_is_no_folder_called_s3(url: str | Path) -> None:
    with pytest.raises(ResultError, match=r"(s3://bucket|file:///?tmp)/out is a URL"), whole(url):
        pass


def test_nothing_else_renames_replaces_or_removes() -> None:
    """What users keep is touched by one module alone."""
    forbidden = {"rename", "rmtree", "renames", "rmdir"}
    for file in PACKAGE.rglob("*.py"):
        if file.name == "outputs.py":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            owner = node.func.value
            of_os = isinstance(owner, ast.Name) and owner.id == "os"
            name = node.func.attr
            if file.name == "spool.py" and name == "rmtree":
                continue  # parts of a file, in the workshop of its folder
            # frames of polars have a method ``rename``
            is_table = (
                name == "rename"
                and not of_os
                and node.args
                and isinstance(node.args[0], ast.Dict | ast.DictComp)
            )
            assert is_table or not (
                name in forbidden or (of_os and name in {"replace", "remove"})
            ), f"{file}:{node.lineno}"


def test_a_wait_ends_at_ctrl_c_also_after_polars_was_imported() -> None:
    code = (
        "import polars, queue, signal; from objstate.interrupts import heed_interrupts\n"
        "heed_interrupts(); print('waits', flush=True)\n"
        "queue.SimpleQueue().get(timeout=60)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": str(PACKAGE.parent)},
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "waits\n"
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20)
    assert "KeyboardInterrupt" in error
