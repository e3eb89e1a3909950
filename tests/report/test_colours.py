"""Colours that can be told from the paper, light and dark."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

STYLE = files("objstate.report").joinpath("assets", "report.css").read_text(encoding="utf-8")
GRAPHICS = 3.0  # WCAG 2.2, 1.4.11: non-text contrast
TEXT = 4.5  # 1.4.3


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb, as WCAG defines it."""
    channels = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def palette(selector: str) -> dict[str, str]:
    """The colours that the first rule of a selector sets."""
    found = re.search(re.escape(selector) + r"\s*\{(.*?)\}", STYLE, re.S)
    assert found
    return dict(re.findall(r"--([\w-]+): (#\w+);", found[1]))


THEMES = [":root", ':root:not([data-theme="light"])', ':root[data-theme="dark"]', ":root:root:root"]


@pytest.mark.parametrize("selector", THEMES)
@pytest.mark.parametrize("paper", ["card", "page"])
def test_everything_drawn_can_be_told_from_the_paper(selector: str, paper: str) -> None:
    colours = palette(selector)
    for name in ("interval", "leaf", "truth", "scan", "clutter", "way", "wall", "wrong"):
        assert contrast(colours[name], colours[paper]) >= GRAPHICS, name
    for name in ("ink", "faint", "wrong"):
        assert contrast(colours[name], colours[paper]) >= TEXT, name


def test_dark_is_one_palette_however_it_is_chosen() -> None:
    assert palette(THEMES[1]) == palette(THEMES[2])
