"""What a batch is asked to do: its logs, each with its building, truth and options."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import count
from pathlib import PurePosixPath

from objstate.batch.addresses import absolute, find_logs
from objstate.batch.manifest import is_manifest, read_manifest
from objstate.errors import LogError, SettingsError, TruthError
from objstate.recording.batches import BatchLog
from objstate.run import RunOptions
from objstate.storage import is_remote, listed

TABLE = ".csv"  # how a remote table of true states ends, and a folder doesn't
ENDINGS = re.compile(r"(\.(mcap|bag|db3|log|clf|carmen|txt|gz|zstd|active))+$", re.IGNORECASE)
UNSAFE = re.compile(r"[^\w.-]+")  # in the names of folders and partitions


@dataclass(frozen=True, eq=False)
class Requested:
    """One log that is asked for. Empty names are chosen later."""

    log: BatchLog
    options: RunOptions


def gather(
    sources: Sequence[str],
    building: str | None,
    truth: str | None,
    options: RunOptions,
) -> list[Requested]:
    """Every log that files, folders, patterns, URLs and manifests name, each once, in their order.

    What a manifest's row says goes before ``building``, ``truth`` and ``options``.
    Raises LogError, SettingsError, TruthError and OutageError.
    """
    requested = [
        each
        for source in sources
        for each in (
            _listed(source, building, options)
            if is_manifest(source)
            else _found(source, building, options)
        )
    ]
    if not requested:
        raise LogError("No log was named; give files, folders, patterns or a manifest.")
    _refuse_twice(requested)
    whole = [replace(each, log=with_truth(each.log, truth)) for each in requested]
    _refuse_missing(whole)
    return whole


def named(requested: Sequence[Requested], known: Collection[BatchLog]) -> list[Requested]:
    """The same logs with names: those they had before, else short and unlike all others.

    Raises SettingsError where a manifest gives one name to two logs.
    """
    before = {log.log: log.name for log in known}
    given = {each.log.log: before.get(each.log.log, each.log.name) for each in requested}
    taken = Counter(filter(None, {**before, **given}.values()))
    twice = [name for name, count in taken.items() if count > 1]
    if twice:
        raise SettingsError(f"Two logs are called '{twice[0]}'; give each a name of its own.")
    new = [address for address, name in given.items() if not name]
    chosen = {**given, **_short_names(new, set(taken))}
    return [replace(each, log=replace(each.log, name=chosen[each.log.log])) for each in requested]


def with_truth(log: BatchLog, truth: str | None) -> BatchLog:
    """The log with the table of true states that ``truth`` holds for it, and the path beside that.

    ``truth`` is one table, or a folder: there, the table is ``NAME.csv`` or ``NAME.truth.csv``
    after the log, or ``truth.csv`` in a folder that is called as the log or holds it.
    """
    if truth is None or log.truth is not None:
        return log
    table = absolute(truth)
    found = _truth_in(table, log.log) if _is_folder(table) else table
    if found is None:
        return log
    return replace(log, truth=found, path=log.path or _path_beside(found))


def _found(source: str, building: str | None, options: RunOptions) -> list[Requested]:
    if building is None:
        raise SettingsError(f"No building is named for {source}; give --building URDF.")
    home = absolute(building)
    return [Requested(BatchLog("", log, home), options) for log in find_logs(source)]


def _listed(source: str, building: str | None, options: RunOptions) -> list[Requested]:
    return [Requested(log, own) for log, own in read_manifest(source, building, options)]


def _refuse_twice(requested: Sequence[Requested]) -> None:
    counts = Counter(each.log.log for each in requested)
    twice = [address for address, count in counts.items() if count > 1]
    if twice:
        raise LogError(f"{twice[0]} is named twice; name each log once.")


def _refuse_missing(requested: Sequence[Requested]) -> None:
    """Raise for a truth that is missing, before hours of work."""
    for each in requested:
        for file in (each.log.truth, each.log.path):
            if file is not None and not _is_there(file):
                raise TruthError(
                    f"There is no file {file}, which is to hold the truth of {each.log.log}."
                )


def _short_names(addresses: Sequence[str], taken: set[str]) -> Mapping[str, str]:
    """The file's stem, with folders' names before or instead of it where that isn't unique."""
    names: dict[str, str] = {}
    left = list(addresses)
    for candidate in (_stem, _folder, _folder_and_stem):
        proposed = Counter(candidate(address) for address in left)
        fit = {a: n for a in left if proposed[n := candidate(a)] == 1 and n not in taken and n}
        names |= fit
        taken |= set(fit.values())
        left = [address for address in left if address not in names]
    for address in left:
        names[address] = next(name for name in _numbered(_stem(address)) if name not in taken)
        taken.add(names[address])
    return names


def _numbered(stem: str) -> Iterator[str]:
    return (f"{stem or 'log'}-{number}" for number in count(2))


def _stem(address: str) -> str:
    return _safe(ENDINGS.sub("", PurePosixPath(address).name))


def _folder(address: str) -> str:
    return _safe(PurePosixPath(address).parent.name)


def _folder_and_stem(address: str) -> str:
    return _safe(f"{_folder(address)}-{_stem(address)}")


def _safe(name: str) -> str:
    return UNSAFE.sub("_", name).strip("._-")


def _is_folder(address: str) -> bool:
    if is_remote(address):
        return not address.lower().endswith(TABLE)
    return os.path.isdir(address)


def _truth_in(folder: str, log: str) -> str | None:
    stem, (home, _, _) = _stem(log), log.rpartition("/")
    folder = folder.rstrip("/")
    candidates = [
        f"{folder}/{stem}.csv",
        f"{folder}/{stem}.truth.csv",
        f"{folder}/{stem}/truth.csv",
        f"{folder}/{home.rpartition('/')[2]}/truth.csv",
    ]
    if f"{home}/".startswith(f"{folder}/"):
        candidates.append(f"{home}/truth.csv")
    return next((address for address in candidates if _is_there(address)), None)


def _path_beside(truth: str) -> str | None:
    """The true path, named after the table: ``NAME.path.tum``, or ``path.tum``."""
    home, _, name = truth.rpartition("/")
    stem = name.removesuffix(".csv").removesuffix("truth")
    path = f"{home}/{stem}{'.' if stem and not stem.endswith('.') else ''}path.tum"
    return path if _is_there(path) else None


def _is_there(address: str) -> bool:
    if not is_remote(address):
        return os.path.isfile(address)
    home, _, name = address.rpartition("/")
    return name in _names_in(home)


@cache
def _names_in(folder: str) -> frozenset[str]:
    """What lies in a remote folder; asked once, as there may be thousands of truths."""
    return frozenset(listed(folder))
