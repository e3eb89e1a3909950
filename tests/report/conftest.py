"""One result for all tests of reports."""

from pathlib import Path

import pytest

from tests.report.pages import make_result


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_result(tmp_path_factory.mktemp("reported"))
