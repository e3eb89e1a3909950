"""What a message's bytes mean: type definitions, decoding, and ROS 1 to ROS 2.

A log's own definition rules; where it carries none, the ROS distributions' do. Two
logs may define one type differently, so every definition has a type store to itself.
Everything is decoded as ROS 2: a ROS 1 message is rewritten as CDR first.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from objstate.errors import LogError
from objstate.lazy import lazy

if TYPE_CHECKING:
    from rosbags.interfaces.typing import Typesdict
    from rosbags.typesys.store import Typestore

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TF = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
POSE_ARRAY = "geometry_msgs/msg/PoseArray"
PARTICLE_CLOUD = "nav2_msgs/msg/ParticleCloud"

# what records are made from
USED_TYPES = {LASER_SCAN, ODOMETRY, *TF, POSE_WITH_COVARIANCE, POSE_ARRAY, PARTICLE_CLOUD}

CDR = "cdr"
ROS1 = "ros1"

MSG = "ros2msg"
IDL = "ros2idl"

HEADER = "std_msgs/msg/Header"

# Not part of any ROS distribution's common interfaces (Nav2 defines it).
PARTICLE_CLOUD_TEXT = """std_msgs/Header header
nav2_msgs/Particle[] particles
================================================================================
MSG: nav2_msgs/Particle
geometry_msgs/Pose pose
float64 weight
"""


# characters; the longest definitions in use, with all that they depend on, have some tens of
# thousands
LONGEST_TEXT = 200_000
# fields of a type and all that it is made of, arrays of strings or messages counted by their
# length: each becomes some lines of a decoder; the longest definitions in use have some hundreds
MOST_FIELDS = 3_000
# types within types; the deepest in use have some ten
DEEPEST = 50
# characters of a parser's message about a definition
LONGEST_REASON = 200
# types kept ready; a log has some tens
MOST_TYPES = 256


@dataclass(frozen=True)
class MessageType:
    """A message type as one log defines it.

    ``wire`` is how its messages are serialized, ``"cdr"`` or ``"ros1"``. ``text`` is the
    definition that the log carries, in ``language`` (``"ros2msg"``, also for ROS 1, or
    ``"ros2idl"``); empty where it carries none.
    """

    name: str  # ROS 2 style: sensor_msgs/msg/LaserScan
    wire: str = CDR
    text: str = ""
    language: str = MSG

    def __reduce__(self) -> tuple[type[MessageType], tuple[str, ...]]:
        """Other processes get what it is, without what was computed of it."""
        return MessageType, (self.name, self.wire, self.text, self.language)

    @lazy
    def definition(self) -> str:
        """The ROS 2 ``.msg`` text with all dependencies, as MCAP's ``ros2msg`` schema has it.

        Raises LogError where neither the log nor any ROS distribution defines the type, or what
        the log has can't be used.
        """
        return self._store.generate_msgdef(self.name, ros_version=2)[0]

    def cdr(self, data: bytes) -> bytes:
        """A message's bytes as ROS 2 CDR. Raises LogError for bytes that don't fit the type."""
        if self.wire == CDR:
            return data
        store = self._store_for(data)
        try:
            return bytes(store.ros1_to_cdr(data, self.name))
        except _decoding_errors() as error:
            raise self._damaged() from error

    def decode(self, data: bytes) -> Any:
        """A message as an object with the type's fields (ROS 2 names; arrays as NumPy's).

        Raises LogError for bytes that don't fit the type.
        """
        cdr, store = self.cdr(data), self._store_for(data)
        try:
            return store.deserialize_cdr(cdr, self.name)
        except _decoding_errors() as error:
            raise self._damaged() from error

    def encode(self, message: object) -> bytes:
        """The CDR bytes of a message object of this type."""
        return bytes(self._store.serialize_cdr(message, self.name))

    def create(self, name: str, /, **fields: Any) -> Any:
        """A message object of this type or of one that it depends on."""
        return self._store.types[name](**fields)

    def _damaged(self) -> LogError:
        return LogError(f"the message is damaged, or not as its type {self.name} is defined")

    def _store_for(self, data: bytes) -> Typestore:
        """The type store, which takes no list for longer than the data, as each item has a byte."""
        self._store.max_sequence_length = max(len(data), 1)
        return self._store

    @lazy
    def _store(self) -> Typestore:
        return _store(self)


def _decoding_errors() -> tuple[type[Exception], ...]:
    from rosbags.serde import SerdeError

    return SerdeError, struct.error, ValueError, IndexError, KeyError, AssertionError


@lru_cache(MOST_TYPES)
def _store(message_type: MessageType) -> Typestore:
    """A type store for one definition. Cached: a log has few definitions, but many messages."""
    from rosbags.typesys import Stores, TypesysError, get_typestore

    own = _own_types(message_type)
    if message_type.wire == ROS1:
        # ROS 2 headers have no ``seq``; the conversion to CDR leaves it out.
        own.pop(HEADER, None)
    types = _closure(message_type, own)
    _check(message_type, types)
    if message_type.name in USED_TYPES:
        _check_fields(message_type, types)
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(types)
    except (TypesysError, SyntaxError) as error:
        raise _unusable(message_type, str(error)) from error
    return store


def _own_types(message_type: MessageType) -> Typesdict:
    from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

    text = message_type.text
    if not text:
        return {}
    if len(text) > LONGEST_TEXT:
        raise _unusable(message_type, f"it has more than {LONGEST_TEXT} characters")
    try:
        if message_type.language == IDL:
            return get_types_from_idl(text)
        return get_types_from_msg(text, message_type.name)
    except (TypesysError, ValueError, LookupError, TypeError, ArithmeticError) as error:
        raise _unusable(message_type, f"it can't be parsed ({error})") from error
    except RecursionError as error:
        raise _unusable(message_type, "it is nested too deeply") from error


def _unusable(message_type: MessageType, why: str) -> LogError:
    told = " ".join(why.split())
    return LogError(
        f"The log's definition of {message_type.name} can't be used: {told[:LONGEST_REASON]}; "
        "leave its topic out, or record it anew"
    )


@cache
def _standard_types(wire: str) -> Typesdict:
    """What ROS defines, with a ROS 2 header in either case."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    ros2 = get_typestore(Stores.LATEST).fielddefs
    particles = get_types_from_msg(PARTICLE_CLOUD_TEXT, PARTICLE_CLOUD)
    if wire == CDR:
        return dict(ros2) | particles
    ros1 = get_typestore(Stores.ROS1_NOETIC).fielddefs
    tf = {"tf2_msgs/msg/TFMessage": ros2["tf2_msgs/msg/TFMessage"]}
    return tf | particles | dict(ros1) | {HEADER: ros2[HEADER]}


def _closure(message_type: MessageType, own: Typesdict) -> Typesdict:
    """The type and all that it depends on, from the log's ``own`` types or standard ones."""
    needed: Typesdict = {}
    waiting = [message_type.name]
    while waiting:
        current = waiting.pop()
        if current in needed:
            continue
        needed[current] = own[current] if current in own else _standard(current, message_type)
        waiting += [n for _, field in needed[current][1] for n in _named(field)]
    return needed


def _standard(name: str, message_type: MessageType) -> Any:
    """A standard type that the log uses and doesn't define; only then they are loaded."""
    standard = _standard_types(message_type.wire)
    if name in standard:
        return standard[name]
    if name == message_type.name:
        raise LogError(
            f"The log does not define the type {name}, and it is not a standard "
            "one: record it as MCAP or rosbag1, which carry definitions."
        )
    raise LogError(f"The definition of {message_type.name} lacks the type {name}, which it uses.")


def _check(message_type: MessageType, types: Typesdict) -> None:
    """Raises LogError where decoding would have no end, or be endlessly long."""
    known: dict[
        str, tuple[int, bool]
    ] = {}  # fields with those of parts, and whether they have bytes

    def extent(name: str, path: tuple[str, ...]) -> tuple[int, bool]:
        if name in path:
            raise _unusable(message_type, f"{name} holds itself")
        if len(path) > DEEPEST:
            raise _unusable(message_type, "it is nested too deeply")
        if name not in known:
            fields, has_bytes = 1, False
            for _, field in types[name][1]:
                count, part, is_list = _parts(field)
                of_part = (1, count > 0) if part is None else extent(part, (*path, name))
                if is_list and part is not None and not of_part[1]:
                    raise _unusable(message_type, f"it has a list of {part}, which holds nothing")
                fields += count * of_part[0]
                has_bytes |= of_part[1]
            known[name] = fields, has_bytes
        return known[name]

    fields, _ = extent(message_type.name, ())
    if fields > MOST_FIELDS:
        raise _unusable(message_type, f"it has {fields} fields, and at most {MOST_FIELDS} are read")


def _check_fields(message_type: MessageType, types: Typesdict) -> None:
    """Raises LogError where a type that records are made from lacks fields that ROS gives it."""
    standard = _standard_types(message_type.wire)
    for name, (_, fields) in types.items():
        if name in standard and (missing := dict(standard[name][1]).items() - dict(fields).items()):
            lacking = sorted(field for field, _ in missing)
            raise _unusable(message_type, f"{name} lacks {', '.join(lacking)} as ROS defines it")


def _parts(field: Any) -> tuple[int, str | None, bool]:
    """A field's least count, its type if it is a message, and whether it is a list.

    Arrays of numbers are read as a whole, and count once.
    """
    from rosbags.interfaces import Nodetype

    kind, detail = field
    if kind == Nodetype.BASE:
        return 1, None, False
    if kind == Nodetype.NAME:
        return 1, detail, False
    (inner, name), length = detail
    part = name if inner == Nodetype.NAME else None
    if kind == Nodetype.SEQUENCE:
        return 1, part, True
    is_numbers = part is None and name[0] != "string"
    return min(length, 1) if is_numbers else length, part, True


def _named(field: Any) -> list[str]:
    from rosbags.interfaces import Nodetype

    kind, detail = field
    if kind == Nodetype.NAME:
        return [detail]
    if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        return _named(detail[0])
    return []
