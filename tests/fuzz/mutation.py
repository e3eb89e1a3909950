"""Mutants of a file: a few random changes to its bytes, or to the words and lines of its text."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable, Sequence

Mutation = Callable[[bytearray, random.Random], None]

INTEGERS = (
    0,
    1,
    2,
    3,
    4,
    7,
    8,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0xFFFF,
    2**20,
    2**31 - 1,
    2**31,
    2**32 - 1,
)
LONG_INTEGERS = (2**33, 2**62, 2**63 - 1, 2**63, 2**64 - 1)
FLOATS = (0.0, -1.0, 1e-300, 1e30, 1e300, -1e300, float("inf"), float("nan"))
WORDS = (
    "0", "-1", "1", "0.0", "-0.5", "1e-300", "1e9", "1e30", "1e300", "-1e300", "nan", "inf", "-inf",
    "4294967295", "4.29497e+09", "9223372036854775808", "9" * 400, "9" * 5000, "1:2", "2021-13-45",
    "0x10", "1_0", "²", "١", "true", "~", "null", "random", "spread", "[]", "{}", "''", '""', ",", ";",
    "\t", " ", "\n", "\r\n", "\x00", "\x1b[2J", "[/red]", "[bold]", ":smile:", "{0}", "%s", "../..", "/",
    ".", "..", "a" * 300, "a" * 5000, "\udcff", "\u202e", "é", "\ufeff", "&a [*a]", "*a", "&a", "!!int x",
    "!!timestamp x", "!!bool x", "!!float x", "!!binary x", "!!set {a}", "<<: [*a, *a]", "? [a]", "- - -",
    "[" * 60, "{a: " * 60, "[" * 2000, "<a>" * 2000, "<!--", "&lt;", "&amp;", "<![CDATA[", "<?xml?>", '"', "'",
)  # fmt: skip


def mutant(seeds: Sequence[bytes], is_text: bool, rng: random.Random) -> bytes:
    """One of the seeds, changed in one to six places."""
    content = bytearray(rng.choice(seeds))
    other = rng.choice(seeds)
    kinds = TEXT if is_text and rng.random() < 0.7 else BYTES
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        if rng.random() < 0.03:
            _splice(content, other, rng)
        else:
            rng.choice(kinds)(content, rng)
    return bytes(content)


def _place(content: bytearray, rng: random.Random) -> int:
    return rng.randrange(len(content) + 1)


def _stretch(content: bytearray, rng: random.Random) -> slice:
    start = _place(content, rng)
    return slice(start, start + rng.choice((1, 2, 4, 8, 16, 64, 512)))


def _splice(content: bytearray, other: bytes, rng: random.Random) -> None:
    start = rng.randrange(len(other) + 1)
    content[_stretch(content, rng)] = other[start : start + rng.choice((8, 64, 512))]


def _flip(content: bytearray, rng: random.Random) -> None:
    if content:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)


def _byte(content: bytearray, rng: random.Random) -> None:
    if content:
        content[rng.randrange(len(content))] = rng.randrange(256)


def _integer(content: bytearray, rng: random.Random) -> None:
    width = rng.choice((1, 2, 4, 8))
    value = rng.choice(INTEGERS + LONG_INTEGERS * (width == 8)) % 256**width
    place = _place(content, rng)
    content[place : place + width] = value.to_bytes(width, rng.choice(("little", "big")))


def _shift(content: bytearray, rng: random.Random) -> None:
    """A number a little larger or smaller than it was."""
    width = rng.choice((1, 2, 4))
    place = _place(content, rng)
    value = int.from_bytes(content[place : place + width], "little") + rng.randint(-16, 16)
    content[place : place + width] = (value % 256**width).to_bytes(width, "little")


def _float(content: bytearray, rng: random.Random) -> None:
    place, value = _place(content, rng), rng.choice(FLOATS)
    if rng.random() < 0.5:
        content[place : place + 8] = struct.pack("<d", value)
    else:
        single = value if abs(value) < 1e38 or value in FLOATS[-2:] else 3e38
        content[place : place + 4] = struct.pack("<f", single)


def _delete(content: bytearray, rng: random.Random) -> None:
    del content[_stretch(content, rng)]


def _repeat(content: bytearray, rng: random.Random) -> None:
    stretch = _stretch(content, rng)
    content[stretch.start : stretch.start] = content[stretch] * rng.choice((1, 1, 2, 20))


def _insert(content: bytearray, rng: random.Random) -> None:
    place = _place(content, rng)
    content[place:place] = rng.randbytes(rng.choice((1, 2, 4, 8, 32)))


def _blank(content: bytearray, rng: random.Random) -> None:
    stretch = _stretch(content, rng)
    content[stretch] = bytes([rng.choice((0, 0xFF, 0x20))]) * len(content[stretch])


def _cut(content: bytearray, rng: random.Random) -> None:
    del content[_place(content, rng) :]


def _word(content: bytearray, rng: random.Random) -> None:
    """A word in the place of another."""
    words = _spans(content, b" \t\n,:;=\"'<>[]{}")
    if words:
        start, end = rng.choice(words)
        content[start:end] = _some_word(rng)


def _insert_word(content: bytearray, rng: random.Random) -> None:
    place = _place(content, rng)
    content[place:place] = _some_word(rng)


def _line(content: bytearray, rng: random.Random) -> None:
    """A line dropped, doubled, or moved."""
    lines = bytes(content).splitlines(keepends=True)
    if not lines:
        return
    line = lines.pop(rng.randrange(len(lines)))
    for _ in range(rng.choice((0, 1, 2, 2, 50))):
        lines.insert(rng.randrange(len(lines) + 1), line)
    content[:] = b"".join(lines)


def _swap_words(content: bytearray, rng: random.Random) -> None:
    words = _spans(content, b" \t\n,:;=\"'<>[]{}")
    if len(words) > 1:
        (a, b), (c, d) = sorted(rng.sample(words, 2))
        content[a:d] = content[c:d] + content[b:c] + content[a:b]


def _some_word(rng: random.Random) -> bytes:
    return rng.choice(WORDS).encode("utf-8", "surrogateescape")


def _spans(content: bytes | bytearray, ends: bytes) -> list[tuple[int, int]]:
    """Where words begin and end."""
    spans, start = [], 0
    for place, byte in enumerate(content):
        if byte in ends:
            if place > start:
                spans.append((start, place))
            start = place + 1
    return spans


BYTES: tuple[Mutation, ...] = (
    _flip, _byte, _integer, _integer, _shift, _float, _delete, _repeat, _insert, _blank, _cut,
)  # fmt: skip
TEXT: tuple[Mutation, ...] = (_word, _word, _word, _insert_word, _line, _line, _swap_words)
