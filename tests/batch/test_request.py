"""Which logs a batch is about, how they are called, and what belongs to them."""

import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.batch.addresses import find_logs
from objstate.batch.request import Requested, gather, named
from objstate.errors import LogError, ObjstateError, SettingsError
from objstate.recording.batches import BatchLog
from objstate.run import RunOptions

PARTS = st.sampled_from(["a", "b", "log", "run 1", "ü", "x.y"])
ADDRESSES = st.lists(
    st.builds(
        lambda folders, stem, ending: "/" + "/".join([*folders, stem + ending]),
        st.lists(PARTS, max_size=3),
        PARTS,
        st.sampled_from([".mcap", ".bag", ".log.gz", ""]),
    ),
    unique=True,
    min_size=1,
    max_size=12,
)


def asked(address: str, name: str = "") -> Requested:
    return Requested(BatchLog(name, address, "/room.urdf"), RunOptions())


def names(requested: list[Requested]) -> dict[str, str]:
    return {each.log.log: each.log.name for each in requested}


@given(ADDRESSES)
def test_every_log_gets_a_name_of_its_own(addresses: list[str]) -> None:
    given_ = list(names(named([asked(a) for a in addresses], [])).values())
    assert len({*given_}) == len(addresses)
    assert all(name and "/" not in name and not name.startswith(".") for name in given_)


@given(ADDRESSES, st.data())
def test_logs_that_come_later_change_no_name(addresses: list[str], data: st.DataObject) -> None:
    first = data.draw(st.integers(1, len(addresses)))
    before = named([asked(a) for a in addresses[:first]], [])
    after = names(named([asked(a) for a in addresses], [each.log for each in before]))
    assert names(before).items() <= after.items()
    assert len({*after.values()}) == len(addresses)


def test_names_are_short() -> None:
    called = names(named([asked(a) for a in ("/x/monday/log.mcap", "/x/tuesday/log.mcap")], []))
    assert list(called.values()) == ["monday", "tuesday"]
    assert list(names(named([asked("/x/drive.log.gz")], [])).values()) == ["drive"]


def drives(folder: Path) -> Path:
    """Three logs that are none, in two folders, beside things that aren't meant as logs."""
    for name in ("mon/a.mcap", "mon/b.bag", "tue/c.mcap", "tue/truth.csv", "tue/map.yaml"):
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("nothing")
    (folder / "bag").mkdir()
    (folder / "bag" / "metadata.yaml").write_text("{}")
    (folder / "bag" / "bag_0.mcap").write_text("nothing")
    return folder


def test_folders_and_patterns_mean_the_logs_in_them(tmp_path: Path) -> None:
    home = drives(tmp_path)
    found = [each.log.log for each in gather([str(home)], "room.urdf", None, RunOptions())]
    assert found == [str(home / name) for name in ("bag", "mon/a.mcap", "mon/b.bag", "tue/c.mcap")]
    pattern = gather([str(home / "*" / "*.mcap")], "room.urdf", None, RunOptions())
    assert str(home / "tue/c.mcap") in {each.log.log for each in pattern}
    assert str(home / "mon/b.bag") not in {each.log.log for each in pattern}


@pytest.mark.parametrize("source", ["", "**/*.mcap"])
def test_a_folder_that_links_to_itself_holds_its_logs_once(tmp_path: Path, source: str) -> None:
    (tmp_path / "day").mkdir()
    (tmp_path / "day" / "a.mcap").write_bytes(b"log")
    (tmp_path / "day" / "again").symlink_to(tmp_path)
    (tmp_path / "round").symlink_to("round")
    (tmp_path / "nowhere").symlink_to("gone")
    os.mkfifo(tmp_path / "pipe")
    found = find_logs(str(tmp_path / source))
    assert found == [str(tmp_path / "day" / "a.mcap")]


def test_a_log_that_is_named_twice_is_refused(tmp_path: Path) -> None:
    home = drives(tmp_path)
    with pytest.raises(LogError, match="twice"):
        gather([str(home), str(home / "mon" / "a.mcap")], "room.urdf", None, RunOptions())


def test_nothing_found_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no log at"):
        gather([str(tmp_path / "*.mcap")], "room.urdf", None, RunOptions())
    with pytest.raises(SettingsError, match="--building"):
        gather([str(drives(tmp_path))], None, None, RunOptions())


@pytest.mark.parametrize(
    ("log", "table", "path"),
    [
        ("mon/a.mcap", "a.csv", "a.path.tum"),
        ("mon/a.mcap", "a.truth.csv", "a.path.tum"),
        ("mon/a.mcap", "a/truth.csv", "a/path.tum"),
        ("mon/a.mcap", "mon/truth.csv", "mon/path.tum"),
    ],
)
def test_the_truth_is_found_by_the_logs_name(
    tmp_path: Path, log: str, table: str, path: str
) -> None:
    truths = tmp_path / "truths"
    for name in (table, path):
        (truths / name).parent.mkdir(parents=True, exist_ok=True)
        (truths / name).touch()
    home = drives(tmp_path)
    (each,) = gather([str(home / log)], "room.urdf", str(truths), RunOptions())
    assert (each.log.truth, each.log.path) == (str(truths / table), str(truths / path))
    (other,) = gather([str(home / "tue/c.mcap")], "room.urdf", str(truths), RunOptions())
    assert other.log.truth is None


def manifest(folder: Path, text: str) -> str:
    path = folder / "manifest.csv"
    path.write_text(text)
    return str(path)


def test_a_row_says_what_is_special_about_its_log(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("localization: {max_particles: 300}")
    source = manifest(
        tmp_path,
        "log,name,building,settings,initial_pose,global\n"
        'a.mcap,first,own.urdf,own.yaml,"1,2,90deg",\n'
        "s3://bucket/b.mcap,,,,,yes\n",
    )
    first, second = gather([source], "/house.urdf", None, RunOptions(seed=4))
    assert first.log == BatchLog("first", str(tmp_path / "a.mcap"), str(tmp_path / "own.urdf"))
    assert first.options.initial_pose == pytest.approx([1.0, 2.0, np.pi / 2])
    assert first.options.settings.localization.max_particles == 300
    assert (second.log.log, second.log.building) == ("s3://bucket/b.mcap", "/house.urdf")
    assert second.options.global_start
    assert {first.options.seed, second.options.seed} == {4}


def test_a_manifest_may_be_parquet(tmp_path: Path) -> None:
    path = tmp_path / "manifest.parquet"
    pl.DataFrame({"log": ["a.mcap"], "seed": [7]}).write_parquet(path)
    (each,) = gather([str(path)], "/house.urdf", None, RunOptions())
    assert each.options.seed == 7


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("log,bulding\na.mcap,x\n", "did you mean 'building'"),
        ("name\nx\n", "no column 'log'"),
        ("log,initial_pose\na.mcap,north\n", "row 1: 'north' is not a pose"),
        ("log,name\na.mcap,../up\n", "row 1: the name '../up'"),
        ("log,name\na.mcap,x\nb.mcap,x\n", "Two logs are called 'x'"),
        ("log,global\na.mcap,maybe\n", "must be yes or no"),
        ("log,seed\na.mcap,-1\n", "whole number"),
        ("log\n", "No log was named"),
    ],
)
def test_what_is_wrong_with_a_manifest_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ObjstateError, match=words):
        named(gather([manifest(tmp_path, text)], "/house.urdf", None, RunOptions()), [])
