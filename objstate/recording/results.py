"""Results are written whole or not at all.

Everything is written under a temporary name beside its target and renamed at
the very end, so that a crash, a full disk or Ctrl-C leaves neither half a result
nor a damaged old one.
"""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from objstate.errors import ResultError

MARK = ".objstate"  # a file that tells a result folder from a folder of somebody's own
MARK_TEXT = "An objstate result, written whole. --overwrite replaces this folder.\n"


@contextmanager
def result_folder(path: str | Path, *, overwrite: bool = False) -> Iterator[Path]:
    """A new folder to fill, which becomes ``path`` when the block ends without an error.

    An existing ``path`` is refused. With ``overwrite`` an earlier result there is
    replaced, at the very end; anything that isn't a result is refused still.
    Raises ResultError.
    """
    with whole(path, overwrite=overwrite, replaceable=is_result) as folder:
        folder.mkdir()
        yield folder
        (folder / MARK).write_text(MARK_TEXT)


def is_result(path: Path) -> bool:
    """Whether ``path`` is a folder that ``result_folder`` wrote, or an empty one."""
    return path.is_dir() and ((path / MARK).is_file() or not any(path.iterdir()))


@contextmanager
def whole(
    path: str | Path, *, overwrite: bool = False, replaceable: Callable[[Path], bool] = Path.is_file
) -> Iterator[Path]:
    """A path of the same name in a temporary folder; what is made there becomes ``path`` at the end.

    Serves for a file as for a folder. ``replaceable`` says whether something that
    exists may be replaced when ``overwrite`` is set. Raises ResultError.
    """
    target = Path(path).absolute()
    _refuse_what_exists(target, overwrite, replaceable)
    workshop = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        workshop.mkdir()
    except OSError as error:
        raise ResultError(
            f"Can't write in {target.parent}: {error.strerror}; choose another place."
        ) from error
    try:
        yield workshop / target.name
        _refuse_what_exists(target, overwrite, replaceable)  # it may have come meanwhile
        _replace(workshop / target.name, target, aside=workshop / "replaced")
    finally:
        shutil.rmtree(workshop)


def _refuse_what_exists(target: Path, overwrite: bool, replaceable: Callable[[Path], bool]) -> None:
    if not (target.exists() or target.is_symlink()):
        return
    if not overwrite:
        raise ResultError(f"{target} exists already; choose another name, or add --overwrite.")
    if target.is_symlink() or not replaceable(target):
        raise ResultError(
            f"{target} is not a result of objstate, so it won't be overwritten; "
            "choose another name, or move it away."
        )


def _replace(made: Path, target: Path, aside: Path) -> None:
    """``made`` in the place of ``target``; the old one is put back if that fails."""
    if not target.exists():
        made.rename(target)
        return
    target.rename(aside)
    try:
        made.rename(target)
    except OSError:
        aside.rename(target)
        raise
