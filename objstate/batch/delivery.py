"""A result folder on its way from the place where it was made to the batch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from objstate.recording.results import MARK, result_folder


def pack(folder: Path) -> dict[str, bytes]:
    """The files of a result folder, by their paths in it."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != MARK)
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def unpack(files: Mapping[str, bytes], out: Path) -> None:
    """Write the result folder ``out``, whole or not at all. Raises ResultError."""
    with result_folder(out, overwrite=True) as folder:
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
