"""Which files of a folder objstate wrote: a list that lies beside them."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from pathlib import Path

LIST_FILE = ".objstate.json"
ABOUT = "Files that objstate wrote here. --overwrite replaces a folder that holds no others."

Fault = Callable[[Path], str | None]  # what of a folder objstate didn't write, if anything


def list_files(folder: Path) -> None:
    """Write the list of the files that a folder holds."""
    names = sorted(path.name for path in folder.iterdir() if path.is_file())
    text = json.dumps({"about": ABOUT, "files": names}, indent=1)
    (folder / LIST_FILE).write_text(text + "\n", encoding="utf-8")


def foreign_in(folder: Path, unlisted: Fault, keep: Collection[str] = ()) -> str | None:
    """What in a folder isn't objstate's, as a clause; None if everything is.

    Files to ``keep`` may be anybody's. ``unlisted`` judges the folders in it that have files, but
    no list.
    """
    if folder.is_symlink() or not folder.is_dir():
        return f"{folder} is no folder"
    entries = sorted(folder.iterdir())
    folders = [each for each in entries if each.is_dir() and not each.is_symlink()]
    for each in folders:
        if fault := foreign_in(each, unlisted):
            return fault
    names = {each.name for each in entries if each not in folders} - {LIST_FILE}
    if not names:
        return None
    listed = _listed(folder)
    if listed is None:
        return unlisted(folder)
    foreign = sorted(names - listed - set(keep))
    return f"objstate didn't write {folder / foreign[0]}" if foreign else None


def _listed(folder: Path) -> set[str] | None:
    """The names that a folder's list holds; None without a list that can be read."""
    try:
        return set(json.loads((folder / LIST_FILE).read_text(encoding="utf-8"))["files"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
