"""The kind of a file by its content, so that an error can name the likely mistake."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path

HEAD = 4096  # bytes read to recognize a file

LOG, BUILDING, MAP, IMAGE = "a log", "a building (URDF)", "a map (YAML)", "an image"
TRUTH, DOORS, PATH = "a table of true states", "a table of doors", "a path (TUM)"
SCENE, RESULT, BATCH = "a scene", "a result of `objstate estimate`", "a batch"
DATABASE = "a database (a log of rosbag2, or a world)"

MAGIC = {
    b"\x89MCAP0": f"{LOG} (MCAP)",
    b"#ROSBAG V": f"{LOG} (rosbag1)",
    b"SQLite format 3": DATABASE,
    b"\x89PNG": IMAGE,
    b"P2\n": IMAGE,
    b"P5\n": IMAGE,
    b"PAR1": "a Parquet table",
}
FOLDERS = {"run.json": RESULT, "batch.json": BATCH, "metadata.yaml": f"{LOG} (rosbag2)"}
CARMEN = re.compile(rb"^(FLASER|RLASER|ROBOTLASER\d|ODOM|PARAM) ", re.MULTILINE)
TUM = re.compile(rb"^(?:#[^\n]*\n|\s*\n)*(?:[-+.\deE]+[ \t]+){7}[-+.\deE]+[ \t]*$", re.MULTILINE)
KEYS = {  # of YAML, at the start of lines; all are required
    MAP: (rb"image:",),
    SCENE: (rb"building:",),
    "a calibration": (rb"lasers:", rb"\s+mount:"),
}
HEADERS = {b"stamp,object,coordinate": TRUTH, b"door,hinge_x": DOORS}
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}


def kind_of(path: str | Path) -> str | None:
    """What a file or folder is, in words; None where it isn't recognized."""
    path = Path(path)
    try:
        if path.is_dir():
            return next((kind for name, kind in FOLDERS.items() if (path / name).is_file()), None)
        with path.open("rb") as file:
            head = file.read(HEAD)
    except (OSError, ValueError):
        return None
    for magic, kind in MAGIC.items():
        if head.startswith(magic):
            return kind
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text.startswith(b"<"):
        return BUILDING if b"<robot" in text else None
    return _kind_of_text(text)


def instead(path: str | Path, wanted: str) -> str | None:
    """A sentence that says what a file is, if that is known and not what was wanted."""
    kind = kind_of(path)
    if kind is None or is_a(kind, wanted):
        return None
    return f"{path} is {kind}, not {wanted}; were two arguments exchanged?"


def is_a(kind: str, wanted: str) -> bool:
    """Whether a kind that ``kind_of`` tells is another one, or a sort of it."""
    return kind == wanted or kind.startswith(f"{wanted} (")


def other_separator(header: str, columns: Collection[str]) -> str | None:
    """The separator of a table's columns, in words, where it isn't the comma."""
    for separator, called in SEPARATORS.items():
        names = {name.strip().strip('"') for name in header.split(separator)}
        if len(names) > 1 and names & set(columns):
            return called
    return None


def _kind_of_text(text: bytes) -> str | None:
    for header, kind in HEADERS.items():
        if text.replace(b";", b",").replace(b"\t", b",").startswith(header):
            return kind
    if CARMEN.search(text):
        return f"{LOG} (CARMEN)"
    if TUM.match(text):
        return PATH
    for kind, keys in KEYS.items():
        if all(re.search(rb"^" + key, text, re.MULTILINE) for key in keys):
            return kind
    return None
