"""Files that commands read and write lie on this machine: URLs are refused before anything is done."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import typer

from objstate.errors import SettingsError


def refuse_urls(app: typer.Typer) -> None:
    """Have every command of ``app``, and of its groups, refuse URLs where it takes paths."""
    for command in app.registered_commands:
        if command.callback is not None:
            command.callback = _refusing(command.callback)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            refuse_urls(group.typer_instance)


def _refusing(command: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(command)
    def checked(**values: Any) -> Any:
        for value in values.values():
            for each in value if isinstance(value, list | tuple) else [value]:
                if isinstance(each, Path):
                    _check(each)
        return command(**values)

    return checked


def _check(path: Path) -> None:
    from objstate.outputs import as_url, is_url

    if is_url(path):
        raise SettingsError(
            f"{as_url(path)} is a URL, which can't be used here; copy the file, or mount the "
            "storage, and give its path. Only what `objstate batch` reads and writes may be URLs."
        )
