"""``objstate estimate``"""

EXAMPLES = ""


def estimate() -> None:
    "x"
