"""README's example and its sample run give what README says, and what its picture shows.

Where these fail because the estimates have changed, ``make docs`` renews README and the picture.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from docs.renew import sample_output
from tests.printing import SAMPLE_OUTPUT, SPEED, compare, run_examples, with_outputs

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PICTURE = ROOT / "docs" / "images" / "corridor.png"
STALE = "out of date: make docs"
TEXT = b"tEXt"  # a chunk of PNG


def test_the_example_prints_what_stands_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert run_examples(README) == 1


@pytest.fixture(scope="module")
def output(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What the sample run prints now."""
    return sample_output(tmp_path_factory.mktemp("sample") / "result")


def test_the_sample_run_prints_what_stands_there(output: str) -> None:
    told = SAMPLE_OUTPUT.search(README.read_text(encoding="utf-8"))
    assert told is not None
    now, then = (SPEED.sub("", text).splitlines() for text in (output, told[2]))
    assert len(now) > 14
    compare(now, then)


def test_the_picture_shows_the_angles_of_the_run(output: str) -> None:
    rows = [line.split() for line in output.splitlines() if "angle (deg)" in line]
    angles = {row[0]: float(row[3]) for row in rows}
    assert len(angles) == 14
    assert json.loads(texts(PICTURE)["Description"]) == pytest.approx(angles, abs=0.1), STALE


def test_outputs_are_put_where_they_were() -> None:
    page = (
        "a\n```python\nx = 1\n```\n\nb\n\n```python\nprint(x)\n```\n\nIt prints\n\n```\n0\n```\nc\n"
    )
    assert with_outputs(page, ["1\n"]) == page.replace("```\n0\n", "```\n1\n")


def texts(png: Path) -> dict[str, str]:
    """The texts that a PNG file holds, by keyword."""
    data, at, found = png.read_bytes(), 8, dict[str, str]()
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == TEXT:
            keyword, _, text = data[at + 8 : at + 8 + length].partition(b"\0")
            found[keyword.decode("latin-1")] = text.decode("latin-1")
        at += 12 + length
    return found
