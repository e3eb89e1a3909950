"""numba's ``njit``, for machines that have no place to keep what it compiles."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

logger = logging.getLogger(__name__)


def njit(**options: Any) -> Callable[[F], F]:
    """``numba.njit(cache=True, **options)``, or without the cache where none can be written.

    numba keeps compiled loops beside their source, else in the user's cache folder, and refuses to
    compile where it may write to neither, as in a container with a read-only file system. Loops are
    called from Python, so that they need no other way in.
    """
    import numba

    options |= {"no_cfunc_wrapper": True}

    def compiled(function: F) -> F:
        try:
            return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
        except RuntimeError:
            _tell()
            return numba.njit(**options)(function)  # type: ignore[no-any-return]

    return compiled


def inner(**options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` for what only compiled loops call.

    It becomes a part of each of those. Were there a function of its own, several loops would hold copies
    of it, rounded differently, and which of them runs would depend on what was compiled or loaded before.
    """
    import numba

    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
    return numba.njit(**options)  # type: ignore[no-any-return]


def when_compiling(tell: Callable[[], None]) -> None:
    """Call ``tell`` once, as soon as a loop is compiled in this process rather than loaded.

    That one is compiled after ``tell`` has returned, which may compile others.
    """
    from numba.core import event

    untold = [tell]

    class Listener(event.Listener):
        def on_start(self, event: object) -> None:
            if untold:
                untold.pop()()

        def on_end(self, event: object) -> None:
            pass

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]


@cache
def _tell() -> None:
    logger.warning(
        "There is no place to keep compiled loops, so every run compiles them anew; "
        "set NUMBA_CACHE_DIR to a folder that can be written."
    )
