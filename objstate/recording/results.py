"""Result folders, which are written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from objstate.outputs import check_free, claimed, whole

MARK = ".objstate"  # a file that marks a folder as a result
MARK_TEXT = "An objstate result, written whole. --overwrite replaces this folder.\n"


@contextmanager
def result_folder(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """A new folder to fill, which becomes ``path`` when the block ends without an error.

    An existing ``path`` is refused. With ``overwrite`` an earlier result there is
    replaced, at the very end; anything that isn't a result is refused still.
    Raises ResultError.
    """
    check_result_folder(path, overwrite=overwrite)
    with claimed(path), whole(path, overwrite=overwrite, replaceable=is_result) as folder:
        folder.mkdir()
        yield folder
        (folder / MARK).write_text(MARK_TEXT)


def check_result_folder(path: str | Path, *, overwrite: bool = False) -> None:
    """Raise ResultError unless ``result_folder`` may be written there; to ask before long work."""
    check_free(path, overwrite=overwrite, replaceable=is_result)


def is_result(path: Path) -> bool:
    """Whether ``path`` is a folder that ``result_folder`` wrote, or an empty one."""
    return path.is_dir() and ((path / MARK).is_file() or not any(path.iterdir()))
