"""ROS message types: definitions and bytes for both generations of ROS.

Messages travel as little-endian CDR, the encoding of ROS 2. A definition that a
log carries is preferred to the standard one, so that custom types pass through.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

from objstate.errors import LogError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

BUILTIN = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
HEADER = "std_msgs/msg/Header"  # of ROS 1 it has one more field, `seq`
IDL_START = "=" * 80 + "\nIDL: "
LITTLE_ENDIAN_CDR = b"\x00\x01"


@cache
def standard_types() -> Typestore:
    """The messages that every ROS 2 installation has."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def to_cdr(type_name: str, message: Any) -> bytes:
    """CDR bytes of a message object of a standard type."""
    return bytes(standard_types().serialize_cdr(message, type_name, little_endian=True))


def is_defined(type_name: str, definition: str | None) -> bool:
    """Whether messages of this type can be understood, field by field."""
    from rosbags.typesys import TypesysError

    try:
        return type_name in ros2_types(type_name, definition).fielddefs
    except (TypesysError, ValueError, KeyError, SyntaxError):
        return False


@cache
def ros2_types(type_name: str, definition: str | None) -> Typestore:
    """A store with the type and all that it is made of, as ROS 2 has it."""
    return _types(type_name, definition, ros1=False)


@cache
def ros1_types(type_name: str, definition: str | None) -> Typestore:
    """The same as ROS 1 has it: with `seq` in the header."""
    return _types(type_name, definition, ros1=True)


def decoded(type_name: str, definition: str | None, cdr: bytes) -> Any:
    """CDR bytes as a message object. Raises LogError where they don't fit the type."""
    with _damage_named(type_name):
        return ros2_types(type_name, definition).deserialize_cdr(cdr, type_name)


def ros1_bytes(type_name: str, definition: str | None, cdr: bytes) -> bytes:
    """CDR bytes in the encoding of ROS 1; `seq` of headers reads 0.

    Raises LogError where they don't fit the type.
    """
    store = ros2_types(type_name, definition)
    with _damage_named(type_name):
        if cdr[:2] != LITTLE_ENDIAN_CDR:
            message = store.deserialize_cdr(cdr, type_name)
            cdr = bytes(store.serialize_cdr(message, type_name, little_endian=True))
        return bytes(store.cdr_to_ros1(cdr, type_name))


@contextmanager
def _damage_named(type_name: str) -> Iterator[None]:
    from rosbags.serde import SerdeError

    try:
        yield
    except (SerdeError, struct.error, ValueError, IndexError, AssertionError) as error:
        raise LogError(
            f"A message of type {type_name} is damaged ({error}); record it anew or leave it out."
        ) from error


def _types(type_name: str, definition: str | None, *, ros1: bool) -> Typestore:
    from rosbags.typesys import Stores, get_typestore

    if definition is None:
        parts = dict(standard_types().fielddefs)
    else:
        parts = _parsed(type_name, definition)
    origin = get_typestore(Stores.ROS1_NOETIC) if ros1 else standard_types()
    parts |= {name: origin.fielddefs[name] for name in (*BUILTIN, HEADER)}
    store = get_typestore(Stores.EMPTY)
    store.register(parts)
    return store


def _parsed(type_name: str, definition: str) -> dict[str, Any]:
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if definition.startswith(IDL_START):
        return dict(get_types_from_idl(definition))
    return dict(get_types_from_msg(definition, type_name))
