"""Addresses of logs: local paths, or any URL of fsspec, such as ``s3://bucket/a.mcap``."""

from __future__ import annotations

import os
import re
import stat
import tempfile
from glob import glob, has_magic
from pathlib import Path, PurePosixPath
from typing import Any

from objstate.errors import LogError
from objstate.logs import is_log
from objstate.logs.rosbag2 import METADATA, is_bag
from objstate.storage import get, is_remote, joined, listed_sizes, opened, retried

SURE = re.compile(r"\.(mcap|bag|db3)$", re.IGNORECASE)  # logs by their names
TRUTHS = (".csv", ".tum")  # tables of true states and true paths, which lie beside logs
PERHAPS = re.compile(r"(\.(log|clf|carmen|txt|gz|zstd|active))+$|^[^.]+$", re.IGNORECASE)
HEAD = 65536  # bytes of a remote file by which its format is told


def absolute(address: str, base: str | None = None) -> str:
    """The same address, good from everywhere; a path is taken relative to the folder ``base``."""
    return joined(base or str(Path.cwd()), address)


def find_logs(source: str) -> list[str]:
    """Every log that a file, a bag's folder, a folder of logs, a pattern or a URL means, sorted.

    A URL may be a folder, or a prefix of a bucket, too. Raises LogError where there is none,
    and OutageError where a storage is out of reach.
    """
    found = logs_at(source)
    if not found:
        raise LogError(f"There is no log at {source}; give files, folders or a quoted pattern.")
    return found


def logs_at(source: str) -> list[str]:
    """The same, of which there may be none. Raises OutageError."""
    return _remote_logs(source) if is_remote(source) else _local_logs(source)


def fetched(address: str, folder: Path) -> Path:
    """A remote log, copied into ``folder`` under its own name. Raises LogError and OutageError."""
    target = folder / address.rstrip("/").rsplit("/", 1)[-1]
    get(address, target)
    refuse_many(address, target)
    return target


def refuse_many(address: str, path: Path) -> None:
    """Raise LogError for a folder of several logs, which would be read as one drive."""
    if path.is_dir() and not is_log(path):
        raise LogError(
            f"{address} is a folder, but no bag with a {METADATA}; name each log in it, or give the "
            "folder to `objstate batch` itself."
        )


def size_of(address: str) -> int:
    """Bytes of a log: a file, or all files of a bag's folder. Raises LogError and OutageError."""
    if is_remote(address):
        return retried(lambda: _remote_size(address), f"Can't reach {address}")
    try:
        state = os.stat(address)
        if not stat.S_ISDIR(state.st_mode):
            return state.st_size
        return sum(part.stat().st_size for part in Path(address).iterdir() if part.is_file())
    except OSError as error:
        raise LogError(f"Can't read {address}: {error.strerror}.") from error


def about_size_of(address: str) -> int:
    """Bytes of a log, without a request for each; 0 where they aren't to be had so."""
    if not is_remote(address):
        try:
            return size_of(address)
        except LogError:
            return 0
    folder, _, name = address.rpartition("/")
    return listed_sizes(folder).get(name, 0)


def _remote_size(address: str) -> int:
    files, place = opened(address)
    info = files.info(place)  # raises where ``du`` would say that there is nothing
    return int(files.du(place) if info["type"] == "directory" else info["size"])


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
    """A file, or every log in a folder at any depth; links back to ``above`` are skipped."""
    if not path.is_dir():
        return [absolute(str(path))] if path.exists() else []
    if is_log(path):
        return [absolute(str(path))]
    here = os.path.realpath(path)
    if here in above:
        return []
    home = absolute(str(path))
    with os.scandir(path) as listed:
        inner = sorted((e for e in listed if not e.name.startswith(".")), key=lambda e: e.name)
    found: list[str] = []
    for each in inner:
        is_link = each.is_symlink()  # which may lead nowhere, or to itself
        if os.path.isdir(each.path) if is_link else each.is_dir():
            found += _logs_in(Path(each.path), above | {here})
        elif (
            (os.path.isfile(each.path) if is_link else each.is_file())
            and not each.name.endswith(TRUTHS)
            and (SURE.search(each.name) or is_log(Path(each.path)))
        ):
            found.append(os.path.join(home, each.name))
    return found


def _remote_logs(source: str) -> list[str]:
    if SURE.search(source) and not has_magic(source):
        return [source]  # perhaps only workers can reach it

    def look() -> list[str]:
        files, path = opened(source)
        named = files.glob(path) if has_magic(source) else [path]
        logs = {log for each in named for log in _remote_logs_in(files, each)}
        return sorted(str(files.unstrip_protocol(log)) for log in logs)

    return retried(look, f"Can't reach {source}")


def _remote_logs_in(files: Any, path: str) -> list[str]:
    """A file as it is; of a folder every log in it, at any depth."""
    if not _is_folder(files, path):
        return [path]
    inner = [PurePosixPath(str(each)) for each in files.find(path)]
    held: dict[PurePosixPath, list[str]] = {}
    for each in inner:
        held.setdefault(each.parent, []).append(each.name)
    bags = {folder for folder, names in held.items() if is_bag(folder.name, names)}
    alone = [each for each in inner if not bags & {*each.parents} and not _is_hidden(each, path)]
    kept = [each for each in alone if _is_remote_log(files, _as_listed(each))]
    return [_as_listed(each) for each in (*bags, *kept)]


def _is_folder(files: Any, path: str) -> bool:
    """Whether it holds files; over HTTP, whether it is a page of links."""
    info = files.info(path)
    return info["type"] == "directory" or "html" in str(info.get("mimetype"))


def _is_hidden(file: PurePosixPath, folder: str) -> bool:
    below = len(PurePosixPath(folder).parts)
    return any(part.startswith(".") for part in file.parts[below:])


def _is_remote_log(files: Any, path: str) -> bool:
    """Whether a file is a log, by its name, or where that may mean anything by how it begins."""
    if SURE.search(path):
        return True
    name = path.rsplit("/", 1)[-1]
    if not PERHAPS.search(name):
        return False
    with tempfile.TemporaryDirectory() as folder:
        head = Path(folder) / name
        head.write_bytes(files.cat_file(path, start=0, end=HEAD))
        return is_log(head)


def _as_listed(path: PurePosixPath) -> str:
    """A path as its storage lists it; of HTTP, whose paths are URLs, with both slashes."""
    return re.sub(r"^(https?):/(?!/)", r"\1://", str(path))
