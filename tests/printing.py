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
SAMPLE_OUTPUT = re.compile(r"(`make run` drives[^\n]*prints\n\n```\n)(.*?)(```)", re.S)
SPEED = re.compile(r"\d+ s of log in .*")  # what no other run repeats


def run_examples(page: Path) -> int:
    """Run a page's examples one after the other, as one program; how many said what they print.

    Where "It prints" follows an example, the words must be those, and the numbers within 0.1.
    """
    text = page.read_text(encoding="utf-8")
    promised = [output for _, output in EXAMPLE.findall(text) if output]
    outputs = printed(text, page.name)
    for found, expected in zip(outputs, promised, strict=True):
        compare(found.splitlines(), expected.splitlines())
    return len(outputs)


def printed(text: str, name: str) -> list[str]:
    """What a page's examples print, run one after the other, of those whose output the page gives."""
    outputs, names = [], dict[str, Any]()
    for example, promised in EXAMPLE.findall(text):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(example, name, "exec"), names)
        if promised:
            outputs.append(out.getvalue())
    return outputs


def with_outputs(text: str, outputs: list[str]) -> str:
    """A page's text with these outputs in place of those that it gives."""
    left = iter(outputs)

    def renewed(found: re.Match[str]) -> str:
        if not found[2]:
            return found[0]
        begin, end = (place - found.start() for place in found.span(2))
        return found[0][:begin] + next(left) + found[0][end:]

    return EXAMPLE.sub(renewed, text)


def compare(lines: list[str], promised_lines: list[str]) -> None:
    """Equal words, and numbers that are nearly equal."""
    words = [re.sub(NUMBER, "0", line) for line in lines]
    assert words == [re.sub(NUMBER, "0", line) for line in promised_lines]
    for line, promised_line in zip(lines, promised_lines, strict=True):
        numbers = [float(number) for number in re.findall(NUMBER, line)]
        expected = [float(number) for number in re.findall(NUMBER, promised_line)]
        assert numbers == pytest.approx(expected, abs=0.1)
