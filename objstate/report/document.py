"""A whole page: one HTML file with its style, its scripts and its data in it."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from objstate.report.markup import element, text

STYLE = "report.css"
COMMON = ("tables.js", "view.js", "motions.js", "figures.js")  # of every page
MOMENTS = "moments.js"  # of a page that shows moments of a log


@dataclass(frozen=True)
class Addition:
    """What a page of another package has beside what is common to all pages."""

    script: str
    style: str
    connects: bool = False  # whether the script talks to the server that the page came from


def whole_page(
    title: str,
    body: str,
    data: Mapping[str, Any] | None = None,
    head: str = "",
    addition: Addition | None = None,
) -> str:
    """A page around ``body``; ``data`` is what its plan moves by.

    The script of an ``addition`` takes the place of that which shows the moments of a log. The
    policy in the page's head lets no script run but its own, whatever names stand in it.
    """
    scripts = [_asset(name) for name in COMMON]
    if addition is not None:
        scripts.append(addition.script)
    elif data is not None:
        scripts.append(_asset(MOMENTS))
    program = "\n".join(scripts)
    style = _asset(STYLE) + (addition.style if addition else "")
    connects = addition is not None and addition.connects
    written = (
        ""
        if data is None
        else element("script", _as_json(data), type="application/json", id="data")
    )
    described = (
        '<meta charset="utf-8">'
        + f'<meta http-equiv="Content-Security-Policy" content="{_policy(program, connects)}">'
        + '<meta name="viewport" content="width=device-width, initial-scale=1">'
        + element("title", text(title))
        + element("style", style)
    )
    inner = element("body", head, element("main", body), written, element("script", program))
    return f'<!doctype html>\n<html lang="en">{element("head", described)}{inner}</html>\n'


def page_head(title: str, said: str) -> str:
    """The head of a page: its title, and the buttons of every page."""
    return element(
        "header",
        element("div", element("h1", text(title)), element("p", text(said))),
        element(
            "div",
            element("button", "print / PDF", id="print", type="button"),
            element("button", "light / dark", id="theme", type="button"),
            class_="buttons",
        ),
    )


def section(title: str, *content: str, name: str | None = None) -> str:
    """A part of a page under a heading."""
    return element("section", element("h2", text(title)), *content, id=name)


def warnings_list(told: list[str]) -> str:
    """Warnings (markup); many of them fold behind their number."""
    if not told:
        return ""
    word = "warning" if len(told) == 1 else "warnings"
    return element(
        "details",
        element("summary", f"{len(told)} {word}"),
        element("ul", *(element("li", each) for each in told)),
        class_="warnings",
        open="open" if len(told) <= WARNINGS_OPEN else None,
    )


WARNINGS_OPEN = 2  # most warnings that are shown open, to leave room for the plan


def _policy(program: str, connects: bool) -> str:
    digest = base64.b64encode(hashlib.sha256(program.encode()).digest()).decode("ascii")
    answering = "connect-src 'self'; " if connects else ""
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; {answering}"
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def _as_json(data: Mapping[str, Any]) -> str:
    written = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    return written.replace("<", "\\u003c")


def _asset(name: str) -> str:
    return files("objstate.report").joinpath("assets", name).read_text(encoding="utf-8")
