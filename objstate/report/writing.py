"""Writing a report beside the result that it shows."""

from __future__ import annotations

from pathlib import Path

from objstate.recording.results import whole
from objstate.report.material import read_material
from objstate.report.page import report_page

REPORT = "report.html"  # in a result folder


def write_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    building: str | Path | None = None,
    truth: str | Path | None = None,
    true_path: str | Path | None = None,
) -> Path:
    """Write the report of a result folder to ``out``, or into the folder, and return its path.

    An older report there is replaced. The building and the truth are those that the
    result names, unless given here. Raises ResultError, BuildingError and TruthError.
    """
    target = Path(folder) / REPORT if out is None else Path(out)
    page = report_page(read_material(folder, building, truth, true_path))
    with whole(target, overwrite=True) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return target
