"""The order in which people expect names: ``door_2`` before ``door_10``."""

from __future__ import annotations

import re

DIGITS = re.compile("([0-9]+)")


def natural_key(name: str) -> tuple[object, ...]:
    """A key to sort names by, in which runs of digits count as numbers, however long they are.

    Names that differ only in leading zeros keep an order of their own, that of their characters.
    """
    parts = DIGITS.split(name)
    texts, digits = parts[::2], [each.lstrip("0") for each in parts[1::2]]
    key: list[object] = [texts[0].casefold()]
    for number, text in zip(digits, texts[1:], strict=True):
        key += [(len(number), number), text.casefold()]
    return (tuple(key), name)
