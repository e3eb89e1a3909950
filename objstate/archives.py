"""A recording of several files as one archive."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

FIRST_DAY = (1980, 1, 1, 0, 0, 0)  # of all files in an archive


def zip_folder(folder: Path, archive: Path) -> None:
    """Pack the files of a folder, uncompressed; equal files give equal bytes."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as zipped:
        for file in sorted(each for each in folder.iterdir() if each.is_file()):
            entry = zipfile.ZipInfo(file.name, FIRST_DAY)
            with file.open("rb") as source, zipped.open(entry, "w", force_zip64=True) as target:
                shutil.copyfileobj(source, target)
