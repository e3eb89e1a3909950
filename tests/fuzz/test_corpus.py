"""The kept corpus, what once went wrong, and a few mutants of every kind of file."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from tests.fuzz.targets import LOGS, TARGETS
from tests.fuzz.worker import fault, mutants

CORPUS = Path(__file__).parent / "corpus"
KEPT = sorted(CORPUS.glob("*/*"))
SEED = 1
LOG_MUTANTS, FILE_MUTANTS = 20, 10


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / "of_fuzz").mkdir()
    return tmp_path / "of_fuzz"


@pytest.mark.parametrize("name", TARGETS)
def test_the_seeds_are_read(name: str, home: Path) -> None:
    """Without an error, so that their mutants reach the inside of the readers."""
    target = TARGETS[name]
    target.prepare(home)
    for seed in target.seeds():
        (home / target.name).write_bytes(seed)
        target.read(home / target.name)


@pytest.mark.parametrize("path", KEPT, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_what_went_wrong_once_goes_right(path: Path, home: Path) -> None:
    target = TARGETS[path.parent.name]
    target.prepare(home)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        assert fault(target, path.read_bytes(), home) is None


@pytest.mark.parametrize("name", TARGETS)
def test_mutants_end_in_results_or_in_errors_that_say_what_where_and_the_cure(
    name: str, home: Path
) -> None:
    target = TARGETS[name]
    target.prepare(home)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        count = LOG_MUTANTS if name in LOGS else FILE_MUTANTS
        for index, content in mutants(name, SEED, 0, count):
            assert fault(target, content, home) is None, index
