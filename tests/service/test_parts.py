"""Laws of the service's parts."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import DoorSettings
from objstate.errors import LogError, SettingsError
from objstate.lazy import altered
from objstate.objects.doors import LatticeFilter
from objstate.service.estimating import unzip
from objstate.service.evidence import told
from objstate.service.moments import parse_moment, words_of
from objstate.service.options import ServiceOptions
from objstate.service.problems import Problem
from objstate.service.tokens import Role
from tests.rooms import door


@given(st.integers(-(2**62), 2**62))
def test_a_moment_in_words_is_the_same_to_the_microsecond(stamp_ns: int) -> None:
    assert parse_moment(str(stamp_ns)) == stamp_ns
    if 0 <= stamp_ns < 10**18:
        assert parse_moment(words_of(stamp_ns)) == stamp_ns // 1000 * 1000


@pytest.mark.parametrize("text", ["", "noon", "2026-01-01", "2026-01-01T00:00:00"])
def test_a_time_without_an_offset_is_none(text: str) -> None:
    with pytest.raises(Problem):
        parse_moment(text)


@given(lower=st.floats(0.0, 1.0), reliability=st.floats(0.01, 0.99))
def test_evidence_is_bayes_rule(lower: float, reliability: float) -> None:
    prior = LatticeFilter(door("door", 0.0, 0.0), DoorSettings()).prior(np.random.default_rng(0))
    before = altered(prior, stamp_ns=1)
    inside = (before.states[:, 0] >= lower) & (before.states[:, 0] <= lower + 0.2)
    share = before.weights.values[inside].sum()
    after = told(before, lower, lower + 0.2, reliability).weights.values
    odds = reliability * share / (reliability * share + (1.0 - reliability) * (1.0 - share))
    assert after[inside].sum() == pytest.approx(odds, abs=1e-9)
    assert after.sum() == pytest.approx(1.0)


def test_each_role_may_what_those_before_it_may() -> None:
    assert Role.ADMIN.allows(Role.TEACH)
    assert Role.TEACH.allows(Role.READ)
    assert not Role.READ.allows(Role.TEACH)


@pytest.mark.parametrize(
    ("host", "more", "good"),
    [
        ("127.0.0.1", {}, True),
        ("::1", {}, True),
        ("0.0.0.0", {}, False),
        ("0.0.0.0", {"behind_proxy": True}, True),
        ("127.0.0.1", {"tls_key": Path("key.pem")}, False),
    ],
)
def test_others_may_listen_in_only_where_that_was_said(
    host: str, more: dict[str, object], good: bool, tmp_path: Path
) -> None:
    options = ServiceOptions(tmp_path / "b.urdf", "w.db", tmp_path, host=host, **more)  # type: ignore[arg-type]
    if good:
        options.check()
        return
    with pytest.raises(SettingsError):
        options.check()


def test_names_in_an_archive_are_never_paths(tmp_path: Path) -> None:
    archive = tmp_path / "drive.zip"
    with zipfile.ZipFile(archive, "w") as zipped:
        zipped.writestr("../../metadata.yaml", "x")
        zipped.writestr("/etc/part_0.mcap", "y")
        zipped.writestr("evil.sh", "z")
    folder = unzip(archive, out(tmp_path))
    assert sorted(each.name for each in folder.iterdir()) == ["metadata.yaml", "part_0.mcap"]


def out(folder: Path) -> Path:
    (folder / "out").mkdir()
    return folder / "out"


@pytest.mark.parametrize("names", [["part.mcap"], ["a/metadata.yaml", "b/metadata.yaml"]])
def test_an_archive_that_is_no_recording_is_refused(names: list[str], tmp_path: Path) -> None:
    archive = tmp_path / "drive.zip"
    with zipfile.ZipFile(archive, "w") as zipped:
        for name in names:
            zipped.writestr(name, "x")
    with pytest.raises(LogError):
        unzip(archive, out(tmp_path))


def test_an_archive_that_grows_without_end_is_refused(tmp_path: Path) -> None:
    archive = tmp_path / "drive.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as zipped:
        zipped.writestr("metadata.yaml", b"0" * 10_000_000)
    with pytest.raises(LogError, match="unpack"):
        unzip(archive, out(tmp_path))
