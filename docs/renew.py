"""Renews what the pages print and the picture in README: ``make docs``, or ``python -m docs.renew``.

Runs the sample log and the pages' examples, puts their output where the old one stands, and draws
README's picture. ``tests/test_readme.py`` and ``tests/test_pages.py`` fail when these are out of date.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.printing import SAMPLE_OUTPUT, printed, with_outputs

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = (README, ROOT / "docs" / "maintenance.md", ROOT / "docs" / "planning.md")


def main() -> None:
    """Renew everything, and say which files changed."""
    from docs.images.corridor import PICTURE, draw_corridor

    with tempfile.TemporaryDirectory() as scratch:
        result = Path(scratch) / "corridor"
        output = sample_output(result)
        text = README.read_text(encoding="utf-8")
        write(README, SAMPLE_OUTPUT.sub(lambda found: f"{found[1]}{output}{found[3]}", text))
        draw_corridor(result)
        print(f"drawn: {PICTURE.relative_to(ROOT)}")
        for folder in ("models", "logs"):
            (Path(scratch) / folder).symlink_to(ROOT / folder)
        os.chdir(scratch)  # where examples may leave files
        for page in PAGES:
            text = page.read_text(encoding="utf-8")
            write(page, with_outputs(text, printed(text, page.name)))
        os.chdir(ROOT)


def sample_output(result: Path) -> str:
    """What ``make run`` prints of the sample log, up to the names of the files, which go to a result folder."""
    sample = "logs/corridor.mcap --building models/corridor/corridor.urdf --truth logs/corridor.truth.csv"
    command = [sys.executable, "cli.py", "estimate", *sample.split(), "--out", str(result)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    lines = [line.rstrip() for line in run.stdout.splitlines() if not line.startswith("Written")]
    return "\n".join(lines).strip("\n") + "\n"


def write(page: Path, text: str) -> None:
    """Put a page's new text in place of the old, if it is another."""
    if text != page.read_text(encoding="utf-8"):
        page.write_text(text, encoding="utf-8")
        print(f"renewed: {page.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
