"""Where logs lie: paths of this machine, or anything that fsspec knows, such as ``s3://bucket/a.mcap``."""

from __future__ import annotations

import os
from glob import glob, has_magic
from pathlib import Path
from typing import Any

from objstate.errors import LogError
from objstate.logs import is_log


def is_remote(address: str) -> bool:
    """Whether an address is a URL rather than a path."""
    return "://" in address


def absolute(address: str, base: Path | None = None) -> str:
    """The same address, good from everywhere; a path is taken relative to ``base``."""
    return address if is_remote(address) else str((base or Path.cwd()) / address)


def find_logs(source: str) -> list[str]:
    """Every log that a file, a bag's folder, a folder of logs, a pattern or a URL means, sorted.

    Raises LogError where there is none.
    """
    found = _remote_logs(source) if is_remote(source) else _local_logs(source)
    if not found:
        raise LogError(f"There is no log at {source}; give files, folders or a quoted pattern.")
    return found


def fetched(address: str, folder: Path) -> Path:
    """A remote log, copied into ``folder`` under its own name. Raises LogError."""
    files, path = _open(address)
    target = folder / path.rstrip("/").rsplit("/", 1)[-1]
    try:
        files.get(path, str(target), recursive=files.isdir(path))
    except Exception as error:  # every storage has exceptions of its own
        raise LogError(f"Can't fetch {address}: {type(error).__name__}: {error}.") from error
    return target


def size_of(address: str) -> int:
    """Bytes of a log: a file, or all files of a bag's folder. Raises LogError."""
    if is_remote(address):
        files, place = _open(address)
        try:
            return int(files.du(place))
        except Exception as error:  # every storage has exceptions of its own
            raise LogError(f"Can't reach {address}: {type(error).__name__}: {error}.") from error
    path = Path(address)
    parts = path.iterdir() if path.is_dir() else [path]
    try:
        return sum(part.stat().st_size for part in parts if part.is_file())
    except OSError as error:
        raise LogError(f"Can't read {address}: {error.strerror}.") from error


def _local_logs(source: str) -> list[str]:
    path = Path(source)
    if path.exists() or not has_magic(source):
        return _logs_in(path)
    matches = sorted(glob(source, recursive=True), key=len)
    found: dict[
        str, str
    ] = {}  # by the true place: a folder that links back matches again and again
    for log in (log for match in matches for log in _logs_in(Path(match))):
        found.setdefault(os.path.realpath(log), log)
    return sorted(found.values())


def _logs_in(path: Path, above: frozenset[str] = frozenset()) -> list[str]:
    """A file as it is; of a folder every log in it, at any depth, links back to those ``above`` apart."""
    if not path.is_dir():
        return [absolute(str(path))] if path.exists() else []
    if is_log(path):
        return [absolute(str(path))]
    here = os.path.realpath(path)
    if here in above:
        return []
    inner = [each for each in sorted(path.iterdir()) if not each.name.startswith(".")]
    logs = [each for each in inner if each.is_dir() or is_log(each)]
    return [log for each in logs for log in _logs_in(each, above | {here})]


def _remote_logs(source: str) -> list[str]:
    if not has_magic(source):
        return [source]
    files, pattern = _open(source)
    return sorted(str(files.unstrip_protocol(path)) for path in files.glob(pattern))


def _open(address: str) -> tuple[Any, str]:
    """The file system of a URL, and the path in it."""
    try:
        from fsspec.core import url_to_fs

        files, path = url_to_fs(address)
    except ImportError as error:
        raise LogError(
            f"{address} can't be reached without a package: {error}. For fsspec itself, "
            "pip install 'objstate[cluster]'."
        ) from error
    except ValueError as error:
        raise LogError(f"{address} can't be reached: {error}.") from error
    return files, path
