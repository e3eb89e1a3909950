"""What the process that reads a log does; a log from outside may be anything."""

from __future__ import annotations

import os
import resource
import shutil
import stat
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from objstate.errors import LogError
from objstate.run import BuildingInput, RunOptions, estimate_log

MOST_FILES = 1000  # in a zipped recording
MOST_GROWTH = 100  # times its size, that a zipped recording may have


@dataclass(frozen=True)
class Context:
    """What is the same for all drives."""

    building: Path
    world: str
    options: RunOptions
    memory_limit: int  # bytes
    scenes: bool  # whether drives are recorded as scenes


@dataclass(frozen=True)
class Job:
    """A log, and where its result is to lie."""

    log: Path
    result: Path


def estimate(context: Context, job: Job, report: Any) -> None:
    """Estimate a drive, and teach the world by it."""
    limit = context.memory_limit
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory(dir=job.log.parent) as folder:
        log = unzip(job.log, Path(folder)) if job.log.suffix == ".zip" else job.log
        building = BuildingInput.read(context.building)
        estimate_log(
            [log],
            building,
            job.result,
            context.options,
            world=context.world,
            overwrite=True,
            on_progress=report,
            mcap=context.scenes,
        )


def unzip(archive: Path, folder: Path) -> Path:
    """The folder, with a zipped recording (rosbag2) unpacked into it; raises LogError for any other archive.

    Names from outside are never used as paths: only a recording's own files are taken, flat.
    """
    try:
        with zipfile.ZipFile(archive) as zipped:
            files = [each for each in zipped.infolist() if not each.is_dir()]
            if len(files) > MOST_FILES:
                raise LogError(f"The archive has {len(files)} files; send one recording.")
            total = sum(each.file_size for each in files)
            if total > MOST_GROWTH * os.path.getsize(archive):
                raise LogError(f"The archive would unpack to {total} bytes; send the files plain.")
            for each in files:
                name = PurePosixPath(each.filename).name
                if stat.S_ISLNK(each.external_attr >> 16) or not _belongs(name):
                    continue
                if (folder / name).exists():
                    raise LogError(f"The archive has two files '{name}'; send one recording.")
                with zipped.open(each) as source, (folder / name).open("wb") as target:
                    shutil.copyfileobj(source, target)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        raise LogError(f"The archive can't be unpacked: {error}; pack it again.") from error
    if not (folder / "metadata.yaml").is_file():
        raise LogError("The archive has no metadata.yaml; zip the folder of a rosbag2 recording.")
    return folder


def _belongs(name: str) -> bool:
    return name == "metadata.yaml" or name.endswith((".db3", ".mcap", ".mcap.zstd", ".db3.zstd"))
