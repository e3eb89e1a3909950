"""The README's example runs, and prints what the README says."""

import contextlib
import io
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NUMBER = r"-?\d+(?:\.\d+)?"


def test_the_example_prints_what_stands_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(.*?)```\n\nIt prints\n\n```\n(.*?)```", text, re.S)
    assert found
    example, promised = found.groups()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(example, "README.md", "exec"), {})
    lines, promised_lines = printed.getvalue().splitlines(), promised.splitlines()
    words = [re.sub(NUMBER, "0", line) for line in lines]
    assert words == [re.sub(NUMBER, "0", line) for line in promised_lines]
    for line, promised_line in zip(lines, promised_lines, strict=True):
        numbers = [float(number) for number in re.findall(NUMBER, line)]
        expected = [float(number) for number in re.findall(NUMBER, promised_line)]
        assert numbers == pytest.approx(expected, abs=0.1)
