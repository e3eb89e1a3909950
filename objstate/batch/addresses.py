"""Where logs lie: paths of this machine, or anything that fsspec knows, such as ``s3://bucket/a.mcap``."""

from __future__ import annotations

import os
import re
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import glob, has_magic
from pathlib import Path, PurePosixPath
from typing import Any

from objstate.errors import LogError, ObjstateError, OutageError, SettingsError
from objstate.logs import is_log
from objstate.outages import causes, outage_of

SURE = re.compile(r"\.(mcap|bag|db3)$", re.IGNORECASE)  # logs by their names
PERHAPS = re.compile(r"(\.(log|clf|carmen|txt|gz|zstd|active))+$|^[^.]+$", re.IGNORECASE)
HEAD = 65536  # bytes of a remote file by which its format is told
METADATA = "metadata.yaml"  # in the folder of a ROS 2 bag

# Exceptions of the packages that fsspec may use, which objstate doesn't import; by their names.
TRANSIENT = {
    "ClientConnectionError",
    "ClientPayloadError",
    "ConnectTimeoutError",
    "EndpointConnectionError",
    "HTTPClientError",
    "HttpError",
    "ServiceRequestError",
}
NO_CREDENTIALS = {"NoCredentialsError", "PartialCredentialsError", "DefaultCredentialsError"}
SERVER_ERRORS = range(500, 600)  # statuses of HTTP


def is_remote(address: str) -> bool:
    """Whether an address is a URL rather than a path."""
    return "://" in address


def absolute(address: str, base: Path | None = None) -> str:
    """The same address, good from everywhere; a path is taken relative to ``base``."""
    return address if is_remote(address) else str((base or Path.cwd()) / address)


def local(address: str, what: str, base: Path | None = None) -> str:
    """The absolute path of a file that must lie on this machine. Raises SettingsError for a URL."""
    if is_remote(address):
        raise SettingsError(
            f"{what} {address} is a URL, and only logs may be; copy the file, or mount the storage, "
            "and give its path."
        )
    return absolute(address, base)


def find_logs(source: str) -> list[str]:
    """Every log that a file, a bag's folder, a folder of logs, a pattern or a URL means, sorted.

    A URL may be a folder, or a prefix of a bucket, too. Raises LogError where there is none,
    and OutageError where a storage is out of reach.
    """
    found = _remote_logs(source) if is_remote(source) else _local_logs(source)
    if not found:
        raise LogError(f"There is no log at {source}; give files, folders or a quoted pattern.")
    return found


def fetched(address: str, folder: Path) -> Path:
    """A remote log, copied into ``folder`` under its own name. Raises LogError and OutageError."""
    files, path = _open(address)
    target = folder / path.rstrip("/").rsplit("/", 1)[-1]
    with _told(f"Can't fetch {address}"):
        files.get(path, str(target), recursive=files.isdir(path))
    refuse_many(address, target)
    return target


def refuse_many(address: str, path: Path) -> None:
    """Raise LogError for a folder that isn't one log: its logs would be read as parts of one drive."""
    if path.is_dir() and not is_log(path):
        raise LogError(
            f"{address} is a folder, but no bag with a {METADATA}; name each log in it, or give the "
            "folder to `objstate batch` itself."
        )


def size_of(address: str) -> int:
    """Bytes of a log: a file, or all files of a bag's folder. Raises LogError and OutageError."""
    if is_remote(address):
        files, place = _open(address)
        with _told(f"Can't reach {address}"):
            info = files.info(place)  # raises where ``du`` would say that there is nothing
            return int(files.du(place) if info["type"] == "directory" else info["size"])
    try:
        state = os.stat(address)
        if not stat.S_ISDIR(state.st_mode):
            return state.st_size
        return sum(part.stat().st_size for part in Path(address).iterdir() if part.is_file())
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
    home = absolute(str(path))
    with os.scandir(path) as listed:
        inner = sorted((e for e in listed if not e.name.startswith(".")), key=lambda e: e.name)
    found: list[str] = []
    for each in inner:
        if not each.is_symlink() and each.is_file() and SURE.search(each.name):
            found.append(os.path.join(home, each.name))
        elif Path(each.path).is_dir() or is_log(Path(each.path)):
            found += _logs_in(Path(each.path), above | {here})
    return found


def _remote_logs(source: str) -> list[str]:
    if SURE.search(source) and not has_magic(source):
        return [source]  # perhaps only workers can reach it
    files, path = _open(source)
    with _told(f"Can't reach {source}"):
        named = files.glob(path) if has_magic(source) else [path]
        logs = {log for each in named for log in _remote_logs_in(files, each)}
    return sorted(str(files.unstrip_protocol(log)) for log in logs)


def _remote_logs_in(files: Any, path: str) -> list[str]:
    """A file as it is; of a folder every log in it, at any depth."""
    if not _is_folder(files, path):
        return [path]
    inner = [PurePosixPath(str(each)) for each in files.find(path)]
    bags = {each.parent for each in inner if each.name == METADATA}
    alone = [each for each in inner if not bags & {*each.parents} and not _is_hidden(each, path)]
    kept = [each for each in alone if _is_remote_log(files, _as_listed(each))]
    return [_as_listed(each) for each in (*bags, *kept)]


def _is_folder(files: Any, path: str) -> bool:
    """Whether it holds files; over HTTP, where there are no folders, whether it is a page of links."""
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


@contextmanager
def _told(what: str) -> Iterator[None]:
    """Turn what a storage raises, each in its own way, into LogError or OutageError."""
    try:
        yield
    except ObjstateError:
        raise
    except Exception as error:
        chain = list(causes(error))
        names = {kind.__name__ for each in chain for kind in type(each).__mro__}
        outage = outage_of(error)
        transient = (
            bool(names & TRANSIENT)
            or any(isinstance(each, TimeoutError | ConnectionError) for each in chain)
            or getattr(error, "status", None) in SERVER_ERRORS
            or (outage is not None and outage.transient)
        )
        is_missing = isinstance(error, FileNotFoundError) and len(chain) == 1
        reason = "there is nothing" if is_missing else f"{type(chain[-1]).__name__}: {chain[-1]}"
        if transient or outage is not None or names & NO_CREDENTIALS:
            raise OutageError(f"{what}: {reason}.", transient) from error
        raise LogError(f"{what}: {reason}.") from error


def _open(address: str) -> tuple[Any, str]:
    """The file system of a URL, and the path in it. Raises LogError and OutageError."""
    try:
        from fsspec.core import url_to_fs

        files, path = url_to_fs(address)
    except ImportError as error:
        raise OutageError(
            f"{address} can't be reached without a package: {error}. For fsspec itself, "
            "pip install 'objstate[cluster]'."
        ) from error
    except ValueError as error:
        raise LogError(f"{address} can't be reached: {error}.") from error
    return files, path
