"""numba's ``njit``, also for machines without a writable cache."""

from __future__ import annotations

import hashlib
import logging
import re
import threading
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
R = TypeVar("R", bound=type)

# "from objstate.x import a, b" at the left margin, also over several lines
IMPORTED = re.compile(r"^from (objstate[\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)

_signatures: dict[Any, str] = {}
_records: dict[str, tuple[type, str]] = {}

logger = logging.getLogger(__name__)


def njit(**options: Any) -> Callable[[F], F]:
    """``numba.njit(cache=True, **options)``, or without the cache where none can be written.

    numba keeps compiled loops beside their source, else in the user's cache folder, and refuses to
    compile where neither can be written, as in a container with a read-only file system. A loop is
    compiled anew when its module changed, or one whose functions and constants it may hold copies
    of; numba itself knows of its own module only.
    """
    import numba

    options |= {"no_cfunc_wrapper": True}

    def compiled(function: F) -> F:
        loop = numba.njit(**options)(function)
        if loop is not function:  # as it is where NUMBA_DISABLE_JIT is set
            try:
                loop._cache = _stored()(function)
            except RuntimeError:
                _tell()
        return loop  # type: ignore[no-any-return]

    return compiled


@cache
def _stored() -> Any:
    """numba's cache of a loop, for modules that depend on others, and with less to load.

    numba prepares for compiling before it loads a compiled loop: it imports SciPy's linear algebra
    and lists all functions that it knows. A loop that is loaded needs none of that, but what counts
    references to arrays, and compiling another one still prepares for it.
    """
    from numba.core.caching import FunctionCache
    from numba.core.runtime.nrt import rtsys

    class Stored(FunctionCache):
        def __init__(self, function: Callable[..., Any]) -> None:
            super().__init__(function)  # type: ignore[no-untyped-call]
            stored = self._cache_file
            stored._source_stamp = stored._source_stamp, digest_of(function.__module__)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            rtsys.initialize(target_context)
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]

    return Stored


@cache
def digest_of(module: str) -> str:
    """A digest of the source of a module and of all that it imports from this package."""
    digest, seen, left = hashlib.sha256(), set[str](), [module]
    while left:
        name = left.pop()
        if name in seen:
            continue
        seen.add(name)
        source, imported = _source_of(name)
        digest.update(source)
        left += imported
    return digest.hexdigest()


@cache
def _source_of(module: str) -> tuple[bytes, list[str]]:
    """A digest of the source of a module of this package, and what it imports from the package.

    The module isn't imported. Both are empty for what is no module.
    """
    path = Path(__file__).parent.joinpath(*module.split(".")[1:])
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        try:
            source = file.read_text(encoding="utf-8")
        except OSError:
            continue
        imported = list[str]()
        for package, names in IMPORTED.findall(source):
            imported += [package, *(f"{package}.{each}" for each in re.findall(r"\w+", names))]
        return hashlib.sha256(source.encode()).digest(), imported
    return b"", []


def inner(makes_arrays: bool = False, **options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` for functions that only compiled loops call.

    They are inlined into each of those. As functions of their own, several loops would hold copies
    of them, rounded differently, and which of these runs would depend on what was compiled or
    loaded before.

    What ``makes_arrays`` counts references to these. In others the counting, which is atomic, took
    up to a third of a loop's time, so that numba is told to leave it out. They may not return an array
    either; numba refuses to compile one that makes an array.
    """
    import numba

    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
    options |= {"_nrt": makes_arrays}
    return numba.njit(**options)  # type: ignore[no-any-return]


def called_with(signature: str) -> Callable[[F], F]:
    """Note how runs call a loop, so that it can be compiled beforehand, see ``types_of``.

    b, i and f stand for truth values, integers and floats, j and g for those of 32 bits, with the
    number of axes where they are arrays. Other words are names of records.
    """

    def noted(loop: F) -> F:
        _signatures[loop] = signature
        return loop

    return noted


def record(name: str, fields: str) -> Callable[[R], R]:
    """Name a record of parameters for ``called_with``; ``fields`` are written in the same way."""

    def noted(kind: R) -> R:
        _records[name] = kind, fields
        return kind

    return noted


def types_of(loop: Callable[..., Any]) -> tuple[Any, ...]:
    """The types of a loop's arguments, as ``called_with`` notes them."""
    return tuple(map(_type_of, _signatures[loop].split()))


def _type_of(word: str) -> Any:
    from numba import types

    if word in _records:
        kind, fields = _records[word]
        parts = tuple(map(_type_of, fields.split()))
        if len(set(parts)) == 1:
            return types.NamedUniTuple(parts[0], len(parts), kind)  # type: ignore[no-untyped-call]
        return types.NamedTuple(parts, kind)  # type: ignore[no-untyped-call]
    plain = {
        "b": types.boolean,
        "i": types.int64,
        "f": types.float64,
        "j": types.int32,
        "g": types.float32,
    }[word[0]]
    return types.Array(plain, int(word[1:]), "C") if word[1:] else plain


def when_compiling(tell: Callable[[], None], after: float = 0.0) -> None:
    """Call ``tell`` once, when loops are compiled in this process rather than loaded.

    Without ``after``, that is before the first is compiled, and ``tell`` may compile others; else
    as soon as compiling has taken that many seconds in all, from another thread.
    """
    from numba.core import event

    watch = _Watch(tell, after)

    class Listener(event.Listener):
        def on_start(self, event: object) -> None:
            watch.start()

        def on_end(self, event: object) -> None:
            watch.end()

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]


class _Watch:
    """Counts the time of compiling; loops may be compiled one inside another."""

    def __init__(self, tell: Callable[[], None], after: float) -> None:
        self._tell: Callable[[], None] | None = tell
        self._left = after
        self._depth = 0
        self._begin = 0.0
        self._timer: threading.Timer | None = None

    def start(self) -> None:
        """Compiling of a loop begins."""
        self._depth += 1
        if self._depth > 1 or self._tell is None:
            return
        if self._left <= 0.0:
            self._now()
            return
        self._begin = time.monotonic()
        self._timer = threading.Timer(self._left, self._now)
        self._timer.daemon = True
        self._timer.start()

    def end(self) -> None:
        """Compiling of a loop ends."""
        self._depth -= 1
        if self._depth or self._timer is None:
            return
        self._timer.cancel()
        self._timer = None
        self._left -= time.monotonic() - self._begin

    def _now(self) -> None:
        tell, self._tell = self._tell, None
        if tell is not None:
            tell()


@cache
def _tell() -> None:
    logger.warning(
        "There is no place to keep compiled loops, so every run compiles them anew; "
        "set NUMBA_CACHE_DIR to a folder that can be written."
    )
