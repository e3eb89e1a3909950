"""Examples in documents: they run, and print what the documents say."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import pytest

NUMBER = r"-?\d+(?:\.\d+)?"
EXAMPLE = re.compile(r"```python\n(.*?)```(?:\n\nIt prints\n\n```\n(.*?)```)?", re.S)


def run_examples(page: Path) -> int:
    """Run a page's examples one after the other, as one program; how many said what they print.

    Where "It prints" follows an example, the words must be those, and the numbers within 0.1.
    """
    checked, names = 0, dict[str, Any]()
    for example, promised in EXAMPLE.findall(page.read_text(encoding="utf-8")):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(example, page.name, "exec"), names)
        if promised:
            checked += 1
            compare(printed.getvalue().splitlines(), promised.splitlines())
    return checked


def compare(lines: list[str], promised_lines: list[str]) -> None:
    """Equal words, and numbers that are nearly equal."""
    words = [re.sub(NUMBER, "0", line) for line in lines]
    assert words == [re.sub(NUMBER, "0", line) for line in promised_lines]
    for line, promised_line in zip(lines, promised_lines, strict=True):
        numbers = [float(number) for number in re.findall(NUMBER, line)]
        expected = [float(number) for number in re.findall(NUMBER, promised_line)]
        assert numbers == pytest.approx(expected, abs=0.1)
