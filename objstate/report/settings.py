"""How a result came about: options, settings, inputs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from objstate.report.markup import element, table, text


def provenance(summary: Mapping[str, Any]) -> str:
    """The last part of a page: version, speed, inputs with their digests, all settings."""
    timings, options = summary["timings"], dict(summary["options"])
    settings = options.pop("settings")
    speed = timings["log_seconds"] / max(timings["elapsed_seconds"], 1e-9)
    said = f"objstate {summary['version']}, {timings['elapsed_seconds']:.1f} s, {speed:.0f} x real time."
    return element(
        "section",
        element("h2", "How it was made"),
        element("p", text(said)),
        _details("Inputs", _inputs(summary["inputs"])),
        _details("Options", _pairs(options)),
        _details("Settings", *(_group(name, value) for name, value in settings.items())),
        _details("Counts", _pairs(summary["counts"])),
    )


def _details(title: str, *content: str) -> str:
    return element("details", element("summary", text(title)), *content)


def _group(name: str, value: Any) -> str:
    shown = _pairs(value) if isinstance(value, Mapping) else element("pre", text(_plain(value)))
    return element("h3", text(name)) + shown


def _pairs(values: Mapping[str, Any]) -> str:
    return table(("", ""), ([text(key), text(_plain(value))] for key, value in values.items()))


def _inputs(inputs: Mapping[str, Any]) -> str:
    files = [
        (role, file)
        for role, value in inputs.items()
        for file in (value if isinstance(value, list) else [value])
    ]
    rows = (
        [text(role), text(file["path"]), f"{file['bytes']:,}", text(file["sha256"][:16])]
        for role, file in files
    )
    return table(("", "file", "bytes", "SHA-256 begins"), rows)


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
