"""Digests of a run's inputs, so that a result can be traced to them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from objstate.building import load_building
from objstate.building.digest import geometry_digest
from objstate.building.model import Building
from objstate.building.problems import check_metres
from objstate.building.urdf import urdf_of
from objstate.errors import TruthError
from objstate.run.options import RunOptions
from objstate.storage import building_here, is_remote


@dataclass(frozen=True, eq=False)
class BuildingInput:
    """A building that was read, and what ``run.json`` says of its files."""

    model: Building
    description: Mapping[str, Any]

    @staticmethod
    def read(urdf: str | Path) -> BuildingInput:
        """Read a URDF with its meshes, or the only one in a folder, from a URL too.

        Raises BuildingError, LogError and OutageError, and TypeError for what is no path.
        """
        if not isinstance(urdf, str | Path):
            raise TypeError(
                f"A {type(urdf).__name__} is no path of a building; give the path of its URDF, or "
                "what objstate.run.BuildingInput.read makes of it."
            )
        here = building_here(str(urdf))
        path = urdf_of(here)
        model = load_building(path)
        check_metres(model)
        given = str(urdf if path == here else path)
        return BuildingInput(model, describe_building(path, model) | {"path": given})


def describe_log(log: Path) -> list[dict[str, Any]]:
    """Path, size and SHA-256 of a log file, or of every file of a bag folder."""
    return [_describe_file(file) for file in _files(log)]


def describe_building(urdf: Path, building: Building) -> dict[str, Any]:
    """The same of a URDF, and a digest of all geometry, in which its mesh files count too."""
    return _describe_file(urdf) | {"geometry_sha256": geometry_digest(building)}


def log_identity(files: Sequence[Mapping[str, Any]], options: RunOptions) -> str:
    """A digest of what was read: the files' contents, in any order, and the part of them."""
    part = {
        "files": sorted(file["sha256"] for file in files),
        "span": [options.start, options.end],
        "topics": None if options.topics is None else sorted(options.topics),
    }
    return hashlib.sha256(json.dumps(part, sort_keys=True).encode()).hexdigest()


def describe_truth(states: str | Path | None, path: str | Path | None) -> dict[str, dict[str, Any]]:
    """The same of files that hold the truth, as ``truth`` and ``true_path``, where given.

    Raises TruthError for one that can't be read.
    """
    files = {"truth": states, "true_path": path}
    try:
        return {k: _describe_file(Path(file)) for k, file in files.items() if file is not None}
    except OSError as error:
        raise TruthError(
            f"Can't read the truth {error.filename}: {error.strerror}; check the path."
        ) from error


def seen_from(folder: str | Path, described: Mapping[str, Any]) -> dict[str, Any]:
    """A described file with its path as seen from ``folder``, so that both may move together."""
    if is_remote(described["path"]):
        return dict(described)
    return {**described, "from_result": os.path.relpath(described["path"], folder)}


def _files(log: Path) -> Iterator[Path]:
    if log.is_dir():
        yield from sorted(path for path in log.iterdir() if path.is_file())
    else:
        yield log


def _describe_file(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"path": str(path), "bytes": path.stat().st_size, "sha256": digest}
