"""The one place where an error becomes a message and an exit code."""

from __future__ import annotations

import atexit
import errno
import gc
import os
import sys
import traceback
from collections.abc import Iterator, Sequence
from typing import Any

from typer import Abort
from typer.exceptions import TyperException
from typer.main import get_command

from objstate.cli.app import app
from objstate.cli.console import print_notice
from objstate.errors import ObjstateError
from objstate.outages import outage_of

PROGRAM = "objstate"

FINE = 0
USER_ERROR = 1
BUG = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, as shells report it

# objects; loading the libraries makes fewer, and a search for garbage among them finds none
OBJECTS_BEFORE_COLLECTION = 500_000

CURES = {
    errno.ENOENT: "check the path",
    errno.EACCES: "check the permissions",
    errno.EPERM: "check the permissions",
    errno.EISDIR: "give a file instead",
    errno.ENOTDIR: "a part of the path is a file",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with ``arguments`` (default: those of the process).

    Returns the exit code: 0 for success, 1 for a user's error, printed on stderr; 3 for a result
    that was written but isn't reliable; 130 after Ctrl-C; 70 for a bug, with its traceback.
    """
    gc.set_threshold(OBJECTS_BEFORE_COLLECTION)
    atexit.register(gc.freeze)  # Python would search all objects for garbage once more as it ends
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for small matrices, more only spin
    try:
        code = app(args=arguments, prog_name=PROGRAM, standalone_mode=False) or FINE
        return _interrupted() if code == INTERRUPTED else code
    except TyperException as error:
        return _refuse(_usage(error, sys.argv[1:] if arguments is None else arguments))
    except ObjstateError as error:
        return _refuse(str(error))
    except OSError as error:
        return _refuse(str(outage_of(error) or _system(error)))
    except MemoryError:
        return _refuse("out of memory; ask for fewer samples, or a coarser resolution.")
    except (Abort, KeyboardInterrupt):
        return _interrupted()
    except Exception as error:
        outage = outage_of(error)
        if outage is not None:
            return _refuse(str(outage))
        traceback.print_exc()
        _tell("this is a bug in objstate, not in your input; please report the lines above.")
        return BUG


def _refuse(message: str) -> int:
    _tell(message)
    return USER_ERROR


def _interrupted() -> int:
    print_notice("interrupted")
    return INTERRUPTED


def _tell(message: str) -> None:
    print_notice(f"error: {message}")


def _usage(error: TyperException, arguments: Sequence[str]) -> str:
    """What is wrong with the arguments, and where to read about them."""
    message = error.format_message().replace("Value error, ", "")  # a word of pydantic's
    return f"{message}\nTry '{' '.join(_commands(arguments))} --help'."


def _commands(arguments: Sequence[str]) -> Iterator[str]:
    """The words that name the command, from the program's name on."""
    yield PROGRAM
    command: Any = get_command(app)
    for word in arguments:
        command = getattr(command, "commands", {}).get(word)
        if command is None:
            return
        yield word


def _system(error: OSError) -> str:
    if error.strerror is None:
        return str(error)
    cure = CURES.get(error.errno or 0)
    place = "" if error.filename is None else f"{error.filename}: "
    return place + error.strerror + (f"; {cure}." if cure else ".")
